#!/usr/bin/env python3
"""What ROS finds of panonav: launch files and parameter files (`node`), and the package in a workspace (`colcon`).

usage: test_package.py node SOURCE COMMAND
       test_package.py colcon SOURCE FOLDER     exit code 77: colcon or its extensions for ROS are not installed
"""
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tomllib
import xml.etree.ElementTree as xml_tree

# Instead of a compiler: every object is empty, so that the workspace is built within seconds.
EMPTY_OBJECTS = """#!/bin/sh
compiler=$1
while [ $# -gt 0 ]; do
  if [ "$1" = -o ]; then exec "$compiler" -x c++ -c /dev/null -o "$2"; fi
  shift
done
"""


def fail(text: str) -> None:
    sys.exit(f"test_package: {text}")


def substitute(text: str, arguments: dict, folder: pathlib.Path) -> str:
    """Replaces $(var NAME) and $(dirname), as launch does."""
    text = re.sub(r"\$\(var (\w+)\)", lambda match: arguments[match[1]], text)
    return text.replace("$(dirname)", str(folder))


def check_launch_file(path: pathlib.Path, command: str) -> None:
    """The node accepts the arguments of the launch file, up to the memory, which does not exist."""
    root = xml_tree.parse(path).getroot()
    arguments = {}
    for arg in root.iter("arg"):
        if not arg.get("description"):
            fail(f"{path.name}: the argument {arg.get('name')} has no description")
        arguments[arg.get("name")] = substitute(arg.get("default") or "absent.panonav", arguments, path.parent)
    executables = list(root.iter("executable"))
    if len(executables) != 1:
        fail(f"{path.name}: {len(executables)} processes are started, not one")
    words = substitute(executables[0].get("cmd"), arguments, path.parent).split()
    if words[:2] != ["panonav", "ros2"]:
        fail(f"{path.name}: starts {words[:2]}")
    ended = subprocess.run([command, *words[1:]], capture_output=True, text=True, check=False, timeout=60)
    if ended.returncode != 2 or "absent.panonav" not in ended.stderr or "o such file" not in ended.stderr:
        fail(f"{path.name}: exit code {ended.returncode}: {ended.stderr}")


def check_parameter_file(path: pathlib.Path, command: str) -> None:
    """The node accepts the parameters, up to the memory or camera file, which does not exist."""
    words = ["ros2", "--ros-args", "--params-file", str(path), "-p", "memory:=absent.panonav"]
    ended = subprocess.run([command, *words], capture_output=True, text=True, check=False, timeout=60)
    if ended.returncode != 2 or "o such file" not in ended.stderr:
        fail(f"{path.name}: exit code {ended.returncode}: {ended.stderr}")


def check_defaults(path: pathlib.Path, command: str) -> None:
    """panonav.yaml states the defaults of the node."""
    printed = subprocess.run([command, "ros2", "--config-template"], capture_output=True, text=True, check=True).stdout
    defaults = {}
    for section in tomllib.loads(re.sub(r"^# (\w+ = )", r"\1", printed, flags=re.M)).values():
        if isinstance(section, dict):
            defaults.update(section)
    parameters = re.findall(r"^    (\w+): ([^ #\n]+)", path.read_text(encoding="utf-8"), re.M)
    if len(parameters) < 10:
        fail(f"{path.name}: only {len(parameters)} parameters are found")
    for name, value in parameters:
        default = defaults.get(name)
        if (value if isinstance(default, str) else json.loads(value)) != default:
            fail(f"{path.name}: {name} is {value}; the default is {default}")


def check_node(source: pathlib.Path, command: str) -> None:
    files = source / "src" / "panonav_ros2"
    launch_files = sorted((files / "launch").iterdir())
    parameter_files = sorted((files / "config").iterdir())
    if len(launch_files) < 2 or len(parameter_files) < 4:
        fail(f"files are missing: {launch_files} {parameter_files}")
    for path in launch_files:
        check_launch_file(path, command)
    for path in parameter_files:
        check_parameter_file(path, command)
    check_defaults(files / "config" / "panonav.yaml", command)


def check_workspace(source: pathlib.Path, folder: pathlib.Path) -> None:
    """colcon finds the package and installs it, so that a shell which sources the workspace finds it, too."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    environment = {**os.environ, "HOME": str(folder), "COLCON_HOME": str(folder), "PATH": f"/usr/bin:{os.environ['PATH']}"}

    def run(*words: str) -> str:
        ended = subprocess.run(words, cwd=folder, env=environment, capture_output=True, text=True, check=False)
        if ended.returncode:
            print(ended.stdout, ended.stderr, sep="\n")
            fail(f"{' '.join(words)}: exit code {ended.returncode}")
        return ended.stdout

    if not shutil.which("colcon") or any(name not in run("colcon", "--help") for name in ("list", "metadata")):
        sys.exit(77)
    listed = run("colcon", "--log-base", "/dev/null", "list", "--base-paths", str(source))
    if listed.split() != ["panonav", str(source), "(ros.cmake)"]:
        fail(f"colcon list: {listed}; are colcon's extensions for ROS installed?")
    compiler = folder / "empty_objects"
    compiler.write_text(EMPTY_OBJECTS, encoding="utf-8")
    compiler.chmod(0o755)
    parts = ("BUILD_COMMAND", "FLEET", "PRECOMPILE", "RECORDINGS", "ROS2", "SERVER", "SIMULATION", "VIEWER")
    run("colcon", "--log-base", "/dev/null", "build", "--base-paths", str(source), "--cmake-args",
        *(f"-DPANONAV_{part}=OFF" for part in parts), f"-DCMAKE_CXX_COMPILER_LAUNCHER={compiler}")
    found = run("sh", "-c", ". install/setup.sh; echo \"$AMENT_PREFIX_PATH|$CMAKE_PREFIX_PATH\"").strip()
    prefix = folder / "install" / "panonav"
    if any(str(prefix) not in paths.split(":") for paths in found.split("|")):
        fail(f"install/setup.sh does not lead to the package: {found}")
    for name in ("share/panonav/package.xml", "share/ament_index/resource_index/packages/panonav"):
        if not (prefix / name).exists():
            fail(f"{name} is not installed")
    if not list(prefix.glob("lib*/**/panonavConfig.cmake")):
        fail("the CMake package is not installed")
    shutil.rmtree(folder)


def main() -> None:
    if len(sys.argv) != 4 or sys.argv[1] not in ("node", "colcon"):
        sys.exit(__doc__)
    source = pathlib.Path(sys.argv[2])
    if sys.argv[1] == "node":
        check_node(source, sys.argv[3])
    else:
        check_workspace(source, pathlib.Path(sys.argv[3]))


if __name__ == "__main__":
    main()
