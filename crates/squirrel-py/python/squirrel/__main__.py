"""`python -m squirrel`: the command line, the same program as the binary `squirrel`."""

import signal
import sys

from squirrel._squirrel import program


def main() -> int:
    """Run the command line on the arguments of this process.

    Returns
    -------
    int
        Exit code: 0 done, 1 failed, 2 wrong usage.
    """
    # The program is not Python's: Ctrl-C ends it at once, as it ends the binary.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return program(["squirrel", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
