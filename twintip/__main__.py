"""The entry point of `python -m twintip` and of the console scripts. Ctrl-C and SIGTERM end the process immediately."""

import gc
import os
import sys

from pipeline.storage.interrupts import end_by_signals, ending_signal, ignore_signals

_STDOUT, _STDERR = 1, 2  # file descriptors


def main() -> int:
    """Run the command of this process and return its exit code, or 128 plus the number of the signal that ended it."""
    code = 0
    try:
        end_by_signals()  # comes first, because loading the libraries takes several seconds
        from twintip.cli import main as run_command

        code = run_command()
        ignore_signals()  # the answer has been printed, and its exit code must not change
        gc.freeze()  # the process is about to end, so garbage collection would waste time
    except BaseException:  # a library may convert an interruption to its own error
        if ending_signal() is None:
            raise
    signal_number = ending_signal()
    if signal_number is None:
        return code
    ignore_signals()
    # At exit, Python flushes a partial answer, and would wait if nothing reads it. The null device takes it instead.
    os.dup2(os.open(os.devnull, os.O_WRONLY), _STDOUT)
    os.write(_STDERR, b"pipeline: interrupted\n")
    return 128 + signal_number


if __name__ == "__main__":
    sys.exit(main())
