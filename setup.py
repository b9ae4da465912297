"""The Python package, built by the library's own CMake: `pip install --no-build-isolation .`

PANONAV_BUILD names an existing build folder, such as build/release; otherwise the library is built in build/python.
The command is not part of the Python package.
"""
import os
import pathlib
import re
import subprocess
import sys

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

ROOT = pathlib.Path(__file__).resolve().parent
# Parts of the build that the Python package does not need.
LEFT_OUT = ("BUILD_COMMAND", "BUILD_TESTS", "LAB", "ROS2", "SERVER", "VIEWER")


class CMakeBuild(build_ext):
    def run(self) -> None:
        build = pathlib.Path(os.environ.get("PANONAV_BUILD") or ROOT / "build" / "python").resolve()
        if not (build / "CMakeCache.txt").exists():
            subprocess.run(
                ["cmake", "-S", ROOT, "-B", build, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release", "-DCMAKE_UNITY_BUILD=ON",
                 f"-DPython_EXECUTABLE={sys.executable}", *(f"-DPANONAV_{part}=OFF" for part in LEFT_OUT)],
                check=True)
        subprocess.run(["cmake", "--build", build, "--target", "panonav_python"], check=True)
        folder = ROOT / "python" if self.inplace else pathlib.Path(self.build_lib).resolve()
        subprocess.run(["cmake", "--install", build, "--component", "python", "--prefix", folder], check=True)

    def get_outputs(self) -> list:
        return [str(path) for path in (pathlib.Path(self.build_lib) / "panonav").glob("*")]


version = re.search(r"project\(panonav VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text()).group(1)
setup(
    version=version,
    packages=["panonav"],
    package_dir={"": "python"},
    package_data={"panonav": ["py.typed", "*.pyi"]},
    ext_modules=[Extension("panonav._core", [])],
    cmdclass={"build_ext": CMakeBuild},
)
