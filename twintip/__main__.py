"""`python -m twintip` and the console scripts: the command line, which Ctrl-C and SIGTERM end immediately."""

import gc
import os
import sys

from pipeline.storage.interrupts import end_by_signals, ending_signal, ignore_signals

_STDOUT, _STDERR = 1, 2


def main() -> int:
    """Run the command of this process and return its exit code, or 128 plus the number of the signal that ended it."""
    code = 0
    try:
        end_by_signals()  # before the libraries are loaded, which takes several seconds
        from twintip.cli import main as command

        code = command()
        ignore_signals()  # the answer is printed, and its exit code is final
        gc.freeze()  # the process ends, so a search for garbage is useless
    except BaseException:  # a library may turn an interruption into an error of its own
        if ending_signal() is None:
            raise
    number = ending_signal()
    if number is None:
        return code
    ignore_signals()
    os.dup2(os.open(os.devnull, os.O_WRONLY), _STDOUT)  # otherwise Python would wait for the reader of a partial answer
    os.write(_STDERR, b"pipeline: interrupted\n")
    return 128 + number


if __name__ == "__main__":
    sys.exit(main())
