"""Builds the Python package by CMake; pyproject.toml says the rest.

STRATA_BUILD_FOLDER names a build folder to use again, such as build/wheel. STRATA_CMAKE_ARGUMENTS are added to CMake's.
STRATA_PYTHON_MODULE names a native part that is built already; nothing is compiled then.
"""
import os
import re
import shlex
import shutil
import subprocess
import sys

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

ROOT = os.path.dirname(os.path.abspath(__file__))


def version():
    """As CMakeLists.txt says it."""
    with open(os.path.join(ROOT, "CMakeLists.txt"), encoding="utf-8") as text:
        return re.search(r"project\(strata VERSION ([0-9.]+)", text.read()).group(1)


def numpy():
    """The NumPy that the native part works with: pybind11 before 2.12 does not know how NumPy 2 lays out its types."""
    command = ["pkg-config", "--modversion", "pybind11"]
    found = subprocess.run(command, capture_output=True, text=True).stdout if shutil.which("pkg-config") else ""
    numbers = [int(number) for number in re.findall(r"\d+", found)[:2]]
    return "numpy>=1.22" if numbers >= [2, 12] else "numpy>=1.22,<2"


class BuildByCMake(build_ext):
    """The native part of the package, from the libraries' sources."""

    def build_extension(self, extension):
        target = os.path.abspath(self.get_ext_fullpath(extension.name))
        os.makedirs(os.path.dirname(target), exist_ok=True)
        shutil.copyfile(os.environ.get("STRATA_PYTHON_MODULE") or self.built(os.path.basename(target)), target)
        strip = shutil.which("strip")
        if strip:
            subprocess.run([strip, "--strip-unneeded", target], check=True)

    def built(self, name):
        """The native part, compiled."""
        folder = os.environ.get("STRATA_BUILD_FOLDER") or os.path.join(os.path.abspath(self.build_temp), "strata")
        jobs = os.environ.get("STRATA_JOBS") or str(os.cpu_count() or 1)
        generator = ["-G", "Ninja"] if shutil.which("ninja") else []
        options = {
            "CMAKE_BUILD_TYPE": "Release",
            "Python_EXECUTABLE": sys.executable,
            "STRATA_WITH_PYTHON": "ON",
            "STRATA_JOIN_SOURCES": "ON",
            "STRATA_BUILD_TOOLS": "OFF",
            "STRATA_BUILD_TESTS": "OFF",
            "STRATA_INSTALL": "OFF",
            "STRATA_WITH_GL": "OFF",
            "STRATA_WITH_OPENMESH": "OFF",
            "STRATA_WITH_OPENVDB": "OFF",
        }
        words = [f"-D{name}={value}" for name, value in options.items()]
        words += shlex.split(os.environ.get("STRATA_CMAKE_ARGUMENTS", ""))
        subprocess.run(["cmake", "-S", ROOT, "-B", folder, *generator, *words], check=True)
        subprocess.run(["cmake", "--build", folder, "-j", jobs, "--target", "strata_python"], check=True)
        made = os.path.join(folder, "python", "strata", name)
        if not os.path.exists(made):
            raise RuntimeError(f"{made} was not built: pybind11-dev, python3-dev and python3-numpy are needed")
        return made


setup(
    version=version(),
    install_requires=[numpy()],
    packages=["strata"],
    package_dir={"": "python"},
    package_data={"strata": ["py.typed", "*.pyi"]},
    ext_modules=[Extension("strata._strata", sources=[])],
    cmdclass={"build_ext": BuildByCMake},
)
