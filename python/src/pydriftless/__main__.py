"""The program: ``driftless`` or ``python -m pydriftless``."""

import sys

from ._core import main as _main


def main() -> None:
    """Run the program with the arguments of this process, and end with its exit code."""
    sys.stdout.flush()
    sys.exit(_main(["driftless", *sys.argv[1:]]))


if __name__ == "__main__":
    main()
