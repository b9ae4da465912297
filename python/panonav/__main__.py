"""`python -m panonav` runs the command `panonav` of the same build, or else the one on the path."""
import os
import pathlib
import shutil
import sys


def main() -> None:
    """Becomes the command, with the same arguments; ends with one line where there is none."""
    beside = pathlib.Path(__file__).with_name("panonav")
    command = beside if beside.exists() else shutil.which("panonav")
    if command is None:
        sys.exit("panonav: the command panonav is not on PATH; install its Debian package, or add build/release/bin")
    # In place of this process: signals, standard input and the exit code are the command's own.
    os.execv(command, ["panonav", *sys.argv[1:]])


if __name__ == "__main__":
    main()
