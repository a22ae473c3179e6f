"""The command line that comes with the package."""

import signal
import sys

from . import _portolan


def main() -> None:
    # Ctrl-C ends the program at once, as it ends the binary: the interpreter would only take a note of it.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.exit(_portolan.run(["portolan", *sys.argv[1:]]))
