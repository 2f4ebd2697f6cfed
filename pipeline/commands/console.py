"""How every command speaks: exit codes, JSON, and what happens when the reader has left."""

import io
import json
import os
import sys
from argparse import ArgumentParser
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TextIO

PASSED, FAILED, WRONG_INPUT, INTERRUPTED = 0, 1, 2, 130
EXIT_CODES = "exit code: 0 all verdicts pass, 1 a verdict failed or is undecided, 2 the input or environment is wrong"


def add_json_flag(parser: ArgumentParser) -> None:
    """Add --json."""
    parser.add_argument("--json", action="store_true", help="print JSON instead of tables")


def add_force_flag(parser: ArgumentParser) -> None:
    """Add --force."""
    words = "write where files are not of the last run or were changed since; they are kept as NAME.bak"
    parser.add_argument("--force", action="store_true", help=words)


def print_json(data: object) -> None:
    """Print data as JSON, in ASCII where the output takes no more; raises ValueError when a number is not finite."""
    text = json.dumps(data, indent=2, allow_nan=False, ensure_ascii=False)
    try:
        text.encode(sys.stdout.encoding or "ascii")
    except UnicodeEncodeError:
        text = json.dumps(data, indent=2, allow_nan=False)
    print(text)


@contextmanager
def answering() -> Iterator[None]:
    """Print an answer inside the block; a reader that has left, or an output that is full, does not undo the work."""
    try:
        yield
        sys.stdout.flush()
    except (BrokenPipeError, SystemExit):  # the second is how rich says the first
        drop_output()
    except OSError as error:
        drop_output()
        print_error(f"the answer cannot be printed: {error.strerror}; the work is done")


def print_error(message: str) -> None:
    """Print one line to stderr, if it takes any; what it does not take is not tried again at exit."""
    try:
        print("pipeline: " + " ".join(message.split()), file=sys.stderr, flush=True)
    except (OSError, ValueError):
        with suppress(OSError, ValueError):
            drop_output(sys.stderr)


def drop_output(stream: TextIO | None = None) -> None:
    """Point a stream, stdout if none, nowhere: Python's own flush at exit does not fail again on what it holds."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), (stream or sys.stdout).fileno())


def setup_stdio() -> None:
    """Give a process streams that can be written: where the shell closed one, it leads nowhere from here on.

    Else the first output file would get its number, and what is printed. A letter that a stream does not have is
    replaced.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)  # noqa: FBT003 - it takes it in place
    sys.stdout = sys.stdout or os.fdopen(1, "w", closefd=False)
    sys.stderr = sys.stderr or os.fdopen(2, "w", closefd=False)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
