#!/usr/bin/env python3
"""Builds the drone's firmware for a Cortex-M7, flies it in QEMU, and compares with the computer.

test_firmware.py FLIGHT SOURCE FOLDER: FLIGHT records a flight with the same program. All velocities must have the same
bits. Prints flash, RAM and the instructions of the longest picture, and fails beyond 128 kB, 64 kB and 3 million.
Exits with 77, skipped, without the tools."""
import pathlib
import re
import shutil
import subprocess
import sys

# The sources of the library that need neither heap, exceptions nor files.
FREESTANDING = """geometry/angles motion/command relative_pose/pair_of_views relative_pose/home_vector
    relative_pose/turn_correlation relative_pose/internal/displacement relative_pose/internal/coherence_weights
    relative_pose/internal/pair_equations route/chain_pilot route/chain_code route/chain_helm route/snapshot_code
    route/snapshot_sampler""".split()
FLAGS = """-std=c++20 -O2 -mcpu=cortex-m7 -mfpu=fpv5-d16 -mfloat-abi=hard -mthumb -ffp-contract=off -fno-exceptions
    -fno-rtti -fno-threadsafe-statics -ffunction-sections -fdata-sections -Wall -Wextra -Werror -Wno-psabi
    -DPANONAV_MAX_DISPLACED_FREQUENCY=5 -nostartfiles -Wl,--gc-sections""".split()
MAX_FLASH = 128 * 1024
MAX_RAM = 64 * 1024
MAX_INSTRUCTIONS = 3_000_000
PROGRAMS = {"arm-none-eabi-g++": "gcc-arm-none-eabi libstdc++-arm-none-eabi-newlib", "qemu-system-arm": "qemu-system-arm"}


def main() -> int:
    flight, source, folder = map(pathlib.Path, sys.argv[1:])
    for program, packages in PROGRAMS.items():
        if shutil.which(program) is None:
            print(f"skipped: there is no {program} (Debian: {packages})")
            return 77
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    subprocess.run([flight, folder], check=True)
    firmware = folder / "drone.elf"
    sources = [source / "tests/firmware/board.cpp", source / "examples/firmware/drone.cpp",
               *(source / "src/panonav" / f"{name}.cpp" for name in FREESTANDING)]
    subprocess.run(["arm-none-eabi-g++", *FLAGS, f"-I{source}/src", f"-I{source}/examples/firmware",
                    "-T", source / "tests/firmware/board.ld", *sources, "-o", firmware], check=True)
    qemu = ["qemu-system-arm", "-M", "mps2-an500", "-nographic", "-monitor", "none", "-serial", "none", "-icount", "shift=0",
            "-semihosting-config", "enable=on,target=native", "-kernel", firmware.name]
    run = subprocess.run(qemu, cwd=folder, capture_output=True, text=True, timeout=240, check=False)
    printed = re.sub(r" +\n", "\n", run.stdout + run.stderr).split("stack ")
    expected = re.sub(r" +\n", "\n", (folder / "flight.txt").read_text())
    if run.returncode or len(printed) != 2:
        print(run.stdout[-1000:], run.stderr[-1000:], f"the firmware ended with {run.returncode}", sep="\n")
        return 1
    lines = expected.splitlines()
    if printed[0] != expected:
        for number, (here, there) in enumerate(zip(lines, printed[0].splitlines())):
            if here != there:
                print(f"picture {number}: the computer decides {here}, the firmware {there}")
                break
        return 1
    if len(set(lines)) < 20:
        print("too few different velocities to compare")
        return 1
    stack, instructions = map(int, re.findall(r"\d+", printed[1]))
    sizes = subprocess.run(["arm-none-eabi-size", firmware], capture_output=True, text=True, check=True).stdout
    text, data, bss = map(int, sizes.splitlines()[1].split()[:3])
    flash, ram = text + data, data + bss + stack
    print(f"{len(lines) - 1} velocities with the same bits; flash {flash} bytes, RAM {ram} bytes (stack {stack}), "
          f"{instructions} instructions for the longest picture")
    return 0 if flash <= MAX_FLASH and ram <= MAX_RAM and instructions <= MAX_INSTRUCTIONS else 1


if __name__ == "__main__":
    sys.exit(main())
