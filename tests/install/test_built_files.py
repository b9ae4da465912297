#!/usr/bin/env python3
"""The target panonav_installed builds all files that `cmake --install` installs, so that it need not build the tests.

usage: test_built_files.py NINJA BUILD
"""
import pathlib
import re
import subprocess
import sys


def main() -> None:
    ninja, build = sys.argv[1], pathlib.Path(sys.argv[2]).resolve()
    commands = {target: subprocess.run([ninja, "-C", build, "-t", "commands", target], text=True, capture_output=True,
                                       check=True).stdout for target in ("all", "panonav_installed")}
    installed = set()
    scripts = [build / "cmake_install.cmake"]
    for folder in ("src", "apps", "python"):
        scripts += (build / folder).rglob("cmake_install.cmake")
    for script in scripts:
        # A part that is only installed by its name has a condition without "OR NOT".
        for part in re.split(r"^if\((?=CMAKE_INSTALL_COMPONENT)", script.read_text(encoding="utf-8"), flags=re.M)[1:]:
            if "OR NOT CMAKE_INSTALL_COMPONENT" in part.splitlines()[0]:
                installed.update(re.findall(rf'"{re.escape(str(build))}/([^"]+?)/?"', part))
    built = {name for name in installed if name in commands["all"]}
    missing = sorted(name for name in built if name not in commands["panonav_installed"])
    if len(built) < 15 or missing:
        sys.exit(f"test_built_files: {len(built)} built files are installed; panonav_installed does not build {missing}")
    print(f"{len(built)} built files are installed")


if __name__ == "__main__":
    main()
