"""`python -m twintip` and the console scripts: the command line, which Ctrl-C and SIGTERM end at once."""

import gc
import os
import sys

from pipeline.storage.interrupts import end_by_signals, ended_by, ignore_signals

_STDOUT, _STDERR = 1, 2


def main() -> int:
    """Run the command of this process and return its exit code, 128 and the number of the signal that ended it."""
    code = 0
    try:
        end_by_signals()  # before the libraries are loaded, which takes longer than a person waits
        from twintip.cli import main as command

        code = command()
        ignore_signals()  # the answer is out, and its exit code holds
        gc.freeze()  # the process ends: nothing is to be searched for what could be freed
    except BaseException:  # a library may turn an interruption into an error of its own
        if ended_by() is None:
            raise
    number = ended_by()
    if number is None:
        return code
    ignore_signals()
    os.dup2(os.open(os.devnull, os.O_WRONLY), _STDOUT)  # or Python would wait for a reader of half an answer
    os.write(_STDERR, b"pipeline: interrupted\n")
    return 128 + number


if __name__ == "__main__":
    sys.exit(main())
