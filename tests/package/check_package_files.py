#!/usr/bin/env python3
"""Files that packages are made of agree with each other and with the formats they are written in.

usage: check_package_files.py SOURCE_FOLDER BUILD_FOLDER VERSION
"""
import configparser
import pathlib
import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree as xml

# Types that shared-mime-info itself knows, or what other programs bring in.
KNOWN_TYPES = {"model/stl", "model/obj", "model/3mf", "model/gltf-binary", "model/gltf+json", "model/x-geomview-off"}
# What the JSON schema of CFF 1.2.0 takes on the first level, and what it asks for.
CFF_KEYS = {
    "abstract", "authors", "cff-version", "commit", "contact", "date-released", "doi", "identifiers", "keywords", "license",
    "license-url", "message", "preferred-citation", "references", "repository", "repository-artifact", "repository-code",
    "title", "type", "url", "version"}
CFF_REQUIRED = {"authors", "cff-version", "message", "title"}

faults = []


def claim(holds, fault):
    if not holds:
        faults.append(fault)


def check_desktop(folder):
    path = folder / "strata-view.desktop"
    entry = configparser.ConfigParser(interpolation=None, delimiters=("=",), strict=True)
    entry.optionxform = str
    entry.read(path, encoding="utf-8")
    section = entry["Desktop Entry"]
    for key in ("Type", "Name", "Comment", "Exec", "Icon", "Categories", "MimeType"):
        claim(section.get(key), f"{path}: {key} is missing")
    claim((folder / (section["Icon"] + ".svg")).exists(), f"{path}: there is no icon {section['Icon']}.svg")
    program = shutil.which("desktop-file-validate")
    if program:
        run = subprocess.run([program, path], capture_output=True, text=True)
        claim(run.returncode == 0 and not run.stdout, run.stdout + run.stderr)
    return set(filter(None, section["MimeType"].split(";")))


def check_types(folder, opened):
    space = "{http://www.freedesktop.org/standards/shared-mime-info}"
    root = xml.parse(folder / "strata.xml").getroot()
    types = [node.get("type") for node in root.iter(space + "mime-type")]
    globs = [node.get("pattern") for node in root.iter(space + "glob")]
    claim(len(types) >= 10 and len(set(types)) == len(types), f"strata.xml: types are missing or there twice: {types}")
    claim(len(set(globs)) == len(globs), "strata.xml: a pattern is there twice")
    claim("*.csg" in globs and "*.vdb" in globs, "strata.xml: *.csg or *.vdb has no type")
    claim(opened == set(types) | KNOWN_TYPES,
          f"strata-view.desktop and strata.xml differ in {sorted(opened ^ (set(types) | KNOWN_TYPES))}")
    claim(xml.parse(folder / "strata.svg").getroot().tag.endswith("svg"), "strata.svg is no SVG")


def check_citation(path, version):
    text = path.read_text(encoding="utf-8")
    keys = re.findall(r"^([a-z-]+):", text, re.MULTILINE)
    claim(len(set(keys)) == len(keys), f"{path}: a key is there twice")
    claim(set(keys) <= CFF_KEYS, f"{path}: unknown keys {sorted(set(keys) - CFF_KEYS)}")
    claim(CFF_REQUIRED <= set(keys), f"{path}: {sorted(CFF_REQUIRED - set(keys))} are missing")
    stated = re.search(r"^version: (\S+)$", text, re.MULTILINE)
    claim(stated and stated.group(1) == version, f"{path}: its version is not {version}")
    claim(re.search(r"^date-released: \d{4}-\d\d-\d\d$", text, re.MULTILINE), f"{path}: no date-released")
    try:
        import yaml
    except ImportError:
        return
    citation = yaml.safe_load(text)
    for authors in [citation["authors"]] + [reference["authors"] for reference in citation["references"]]:
        for author in authors:
            claim("name" in author or {"family-names", "given-names"} <= set(author), f"{path}: author {author}")


def check_packages(config, version):
    text = config.read_text(encoding="utf-8")
    values = dict(re.findall(r'^set\((CPACK_\S+) "((?:[^"\\]|\\.)*)"\)', text, re.MULTILINE))
    claim(values.get("CPACK_PACKAGE_VERSION") == version, f"{config}: its version is not {version}")
    components = values.get("CPACK_COMPONENTS_ALL", "").split(";")
    for component in ("strata", "dev"):
        claim(component in components, f"{config}: no component {component}")
    for component in components:
        for key in ("PACKAGE_NAME", "PACKAGE_SECTION", "DESCRIPTION"):
            claim(values.get(f"CPACK_DEBIAN_{component.upper()}_{key}"), f"{config}: {component} has no {key}")
    claim("libfmt-dev" in values.get("CPACK_DEBIAN_DEV_PACKAGE_DEPENDS", ""), f"{config}: libstrata-dev needs no libfmt-dev")


def main():
    source, build, version = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3]
    folder = source / "apps/view/desktop"
    check_types(folder, check_desktop(folder))
    check_citation(source / "CITATION.cff", version)
    check_packages(build / "CPackConfig.cmake", version)
    changes = (source / "CHANGELOG.md").read_text(encoding="utf-8")
    claim(f"## [{version}]" in changes, f"CHANGELOG.md says nothing of {version}")
    for fault in faults:
        print(fault)
    return 1 if faults else 0


sys.exit(main())
