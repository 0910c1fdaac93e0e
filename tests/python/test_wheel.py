"""What pip makes of the source folder. The native part is the one that is built already."""
import glob
import importlib.util
import os
import shutil
import subprocess
import sys
import zipfile

import pytest
from conftest import ROOT, data

from strata import _strata


def test_the_wheel_can_be_installed_and_imported(tmp_path):
    for module in ("pip", "setuptools", "wheel"):
        if importlib.util.find_spec(module) is None:
            pytest.skip(f"python3-{module} is missing")
    source = tmp_path / "source"
    source.mkdir()
    for name in ("pyproject.toml", "setup.py", "CMakeLists.txt"):
        shutil.copy(os.path.join(ROOT, name), source)
    shutil.copytree(os.path.join(ROOT, "python"), source / "python")
    (source / "docs").mkdir()
    shutil.copy(os.path.join(ROOT, "docs", "python.md"), source / "docs")
    clean = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check"]
    subprocess.run(
        [*pip, "wheel", str(source), "--no-build-isolation", "--no-deps", "--no-index", "--wheel-dir", str(tmp_path)],
        env={**clean, "STRATA_PYTHON_MODULE": _strata.__file__},
        check=True,
        capture_output=True,
        text=True,
    )
    (wheel,) = glob.glob(f"{tmp_path}/strata_toolkit-{_strata.version}-*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    for name in ("__init__.py", "csg.py", "py.typed", "_strata.pyi"):
        assert f"strata/{name}" in names
    place = tmp_path / "place"
    subprocess.run([*pip, "install", "--no-deps", "--no-index", "--target", str(place), wheel], env=clean, check=True, capture_output=True)
    code = "import strata, sys; print(strata.__file__, strata.voxelize(sys.argv[1], resolution=32).count > 0)"
    done = subprocess.run(
        [sys.executable, "-c", code, data("knot.obj")], env={**clean, "PYTHONPATH": str(place)}, check=True, capture_output=True, text=True
    )
    assert done.stdout.split() == [str(place / "strata" / "__init__.py"), "True"]
