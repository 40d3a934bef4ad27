"""The program: ``driftless`` or ``python -m pydriftless``."""

import signal
import sys

from ._core import main as _main


def main() -> None:
    """Run the program with the arguments of this process, and end with its exit code."""
    sys.stdout.flush()
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        # Ctrl-C is the program's, as where there is no Python around it.
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.exit(_main(["driftless", *sys.argv[1:]]))


if __name__ == "__main__":
    main()
