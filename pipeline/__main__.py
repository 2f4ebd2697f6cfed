"""`python -m pipeline` and the console scripts: the command line, which Ctrl-C and SIGTERM end at once."""

import gc
import os
import signal
import sys

from pipeline.storage.interrupts import end_by_signals, ended_by, leave_signals

_STDOUT, _STDERR = 1, 2


def main() -> int:
    """Run the command of this process and return its exit code, 128 and the number of the signal that ended it."""
    code = 0
    try:
        end_by_signals()  # before the libraries are loaded, which takes longer than a person waits
        from pipeline.cli import main as command

        code = command()
        leave_signals(signal.SIG_DFL)  # the answer is out, and nothing is left to clear
        gc.freeze()  # nor to be searched for what could be freed: the process ends
    except BaseException:  # a library may turn an interruption into an error of its own
        if ended_by() is None:
            raise
    number = ended_by()
    if number is None:
        return code
    leave_signals(signal.SIG_IGN)
    os.dup2(os.open(os.devnull, os.O_WRONLY), _STDOUT)  # or Python would wait for a reader of half an answer
    os.write(_STDERR, b"pipeline: interrupted\n")
    return 128 + number


if __name__ == "__main__":
    sys.exit(main())
