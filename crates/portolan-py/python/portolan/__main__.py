"""``python -m portolan``."""

from ._command import main

main()
