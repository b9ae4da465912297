"""`python -m panonav` is the command `panonav`, which lies beside this file."""
import os
import pathlib
import sys


def main() -> None:
    command = pathlib.Path(__file__).with_name("panonav")
    if not command.exists():
        sys.exit("panonav: this package was built without the command")
    # In place of this process: signals, standard input and the exit code are the command's own.
    os.execv(command, ["panonav", *sys.argv[1:]])


if __name__ == "__main__":
    main()
