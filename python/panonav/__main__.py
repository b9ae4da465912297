"""`python -m panonav` is the command `panonav`, which lies beside this file or on the path."""
import os
import pathlib
import shutil
import sys


def main() -> None:
    """Becomes the command, with the same arguments; ends with one line where there is none."""
    beside = pathlib.Path(__file__).with_name("panonav")
    command = beside if beside.exists() else shutil.which("panonav")
    if command is None:
        sys.exit("panonav: the command is neither beside this package nor on the path")
    # In place of this process: signals, standard input and the exit code are the command's own.
    os.execv(command, ["panonav", *sys.argv[1:]])


if __name__ == "__main__":
    main()
