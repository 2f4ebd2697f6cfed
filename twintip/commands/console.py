"""How every command speaks: exit codes, JSON, progress, and what happens when the reader has left."""

import json
import os
import signal
import sys
from argparse import ArgumentParser
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

from pipeline.storage.interrupts import signals_for_this_thread
from sensor.quantity import InputError, written_number

PASSED, FAILED, WRONG_INPUT = 0, 1, 2
_HALF_A_LINE = 1500  # letters: every honest message is shorter than two
EXIT_CODES = {
    PASSED: "all verdicts pass",
    FAILED: "one fails or is undecided",
    WRONG_INPUT: "wrong input",
    128 + signal.SIGINT: "ended by Ctrl-C",
    128 + signal.SIGTERM: "by SIGTERM",
}
"""What each exit code of a command says; `__main__` returns those from 128 on."""


def add_json_flag(parser: ArgumentParser) -> None:
    """Add --json."""
    parser.add_argument("--json", action="store_true", help="print JSON instead of tables")


def add_counts_flag(parser: ArgumentParser) -> None:
    """Add --counts-as."""
    words = "how counts without signs are written: in two's complement, or with half the range added"
    parser.add_argument("--counts-as", choices=("unsigned", "offset"), help=words)


def add_force_flag(parser: ArgumentParser) -> None:
    """Add --force."""
    words = "keep what is in the way as NAME.bak, also where it was changed since it was written"
    parser.add_argument("--force", action="store_true", help=words)


def number(text: str) -> float:
    """Return the number of a flag, as people write it; raises ValueError for another text."""
    value = written_number(text)
    if value is None:
        raise ValueError(text)
    return value


def print_json(data: object) -> None:
    """Print data as JSON; raises ValueError when a number is not finite."""
    print(json.dumps(data, indent=2, allow_nan=False, ensure_ascii=sys.stdout.encoding != "utf-8"))


@contextmanager
def answering() -> Iterator[None]:
    """Print an answer inside the block; a reader that has left does not undo the work.

    Raises InputError where the answer is lost, as on a full disk.
    """
    try:
        yield
        sys.stdout.flush()
    except (BrokenPipeError, SystemExit):  # the second is how rich says the first
        drop_output()
    except OSError as error:
        drop_output()
        msg = f"the answer cannot be printed: {reason_of(error)}. The work is done; free some room for its answer."
        raise InputError(msg) from error


@contextmanager
def refusing_what_cannot_be_solved() -> Iterator[None]:
    """Raise InputError in place of what mesher, solvers and writers of files raise for a scene that is beyond them."""
    from cad.files.export_error import ExportError
    from mesh.session import MeshError
    from solve.linear import SolveError

    try:
        yield
    except (ExportError, MeshError, SolveError) as error:
        raise InputError(str(error)) from error


def print_error(message: str) -> None:
    """Print one line to stderr, if it takes any; what would steer a terminal is written as its escape."""
    line = " ".join(message.split())
    if len(line) > 2 * _HALF_A_LINE:  # a name or a value from outside that has no end; what to do stands last
        line = f"{line[:_HALF_A_LINE]} ... {line[-_HALF_A_LINE:]}"
    plain = "".join(letter if letter.isprintable() else repr(letter)[1:-1] for letter in line)
    with suppress(OSError):
        print(f"pipeline: {plain}", file=sys.stderr, flush=True)


def reason_of(error: OSError) -> str:
    """Return the system's words for an error, or the error's kind where a library gives none."""
    return error.strerror or str(error) or type(error).__name__


def drop_output() -> None:
    """Point stdout nowhere, so that Python's own flush at exit does not fail again on what it holds."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


@contextmanager
def showing_progress(work: str, *, quiet: bool = False) -> Iterator[Callable[[str], None]]:
    """Give the function that reports progress, which shows it on stderr where that is a terminal and not `quiet`."""
    from rich.console import Console

    console = Console(stderr=True)
    if quiet or not console.is_terminal:
        yield lambda _: None
        return
    status = console.status(work)
    try:
        with signals_for_this_thread():  # it starts one that draws
            status.start()
        yield status.update
    finally:
        status.stop()
