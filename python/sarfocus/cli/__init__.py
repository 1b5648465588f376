"""The command line `sarfocus`."""

from __future__ import annotations

import signal
import sys


def main(arguments: list[str] | None = None) -> int:
    """Run the command line and return its exit status: 0 done, 1 failure inside, 2 wrong usage or bad input, 130 interrupted."""
    argv = sys.argv[1:] if arguments is None else arguments
    if arguments is None:
        # Started in the background by a script, a process inherits an ignored SIGINT; Ctrl-C must work all the same.
        signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        from .run import run  # noqa: PLC0415  the imports take a moment, in which Ctrl-C must end in one line too

        return run(argv)
    except KeyboardInterrupt:
        sys.stderr.write("sarfocus: interrupted\n")
        return 130
