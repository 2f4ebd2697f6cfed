"""Output of all commands: answers, exit codes, one-line errors, and readers that leave early."""

import json
import os
import signal
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from sensor.quantity import InputError

if TYPE_CHECKING:
    from rich.console import RenderableType  # help and refusals do not need it

PASSED, FAILED, WRONG_INPUT = 0, 1, 2
_HALF_A_LINE = 1500  # [characters]; every regular message is shorter than twice this
EXIT_CODES = {
    PASSED: "all verdicts pass",
    FAILED: "one fails or is undecided",
    WRONG_INPUT: "wrong input",
    128 + signal.SIGINT: "ended by Ctrl-C",
    128 + signal.SIGTERM: "by SIGTERM",
}
"""The meaning of each exit code; `__main__` returns those from 128 on."""


@dataclass(frozen=True, kw_only=True)
class Answer:
    """The answer of a command: its exit code, and the data of `--json` or the printed output.

    `text` is printed unchanged, and `parts` are laid out by rich in `width` characters. A command that reads a stream
    yields an answer for each press, whose data are on one line. `files` were written; with data, their paths are
    printed on stderr.
    """

    code: int
    data: object = None
    text: str = ""
    parts: Iterable["RenderableType"] = ()
    width: int | None = None
    of_stream: bool = False
    files: Sequence[Path] = ()


def print_answer(answer: Answer, *, as_json: bool) -> None:
    """Print an answer. A reader that left undoes no work, but ends the reading of a stream by BrokenPipeError."""
    with nullcontext() if answer.of_stream else answering():
        if as_json and answer.data is not None:
            print_json(answer.data, indent=None if answer.of_stream else 2)
        elif not as_json:
            if answer.parts:
                from pipeline.report.verdict_table import print_parts

                print_parts(answer.parts, answer.width)
            if answer.text:
                print(answer.text)
        for path in answer.files:
            print(path, file=sys.stderr if as_json else sys.stdout)
        sys.stdout.flush()


def print_json(data: object, indent: int | None = 2) -> None:
    """Print data as JSON; raises ValueError for a number that is not finite."""
    print(json.dumps(data, indent=indent, allow_nan=False, ensure_ascii=sys.stdout.encoding != "utf-8"))


@contextmanager
def answering() -> Iterator[None]:
    """Print an answer inside the block; a reader that left does not undo the work.

    Raises InputError if the answer is lost, for instance on a full disk.
    """
    try:
        yield
        sys.stdout.flush()
    except (BrokenPipeError, SystemExit):  # rich turns BrokenPipeError into SystemExit
        drop_output()
    except OSError as error:
        drop_output()
        msg = f"the answer cannot be printed: {reason_of(error)}. The work is done; free some room for its answer."
        raise InputError(msg) from error


@contextmanager
def refusing_what_cannot_be_solved() -> Iterator[None]:
    """Raise InputError in place of errors by mesher, solvers and file writers for a scene beyond their range."""
    from cad.files.export_error import ExportError
    from mesh.session import MeshError
    from solve.linear import SolveError

    try:
        yield
    except (ExportError, MeshError, SolveError) as error:
        raise InputError(str(error)) from error


def print_error(message: str) -> None:
    """Print one line to stderr if possible; control characters are escaped."""
    line = " ".join(message.split())
    if len(line) > 2 * _HALF_A_LINE:  # an endless name or value from outside; the hint is at the end
        line = f"{line[:_HALF_A_LINE]} ... {line[-_HALF_A_LINE:]}"
    plain = "".join(letter if letter.isprintable() else repr(letter)[1:-1] for letter in line)
    with suppress(OSError):
        print(f"pipeline: {plain}", file=sys.stderr, flush=True)


def reason_of(error: OSError) -> str:
    """Return the system's description of an error, or its type if a library gives none."""
    return error.strerror or str(error) or type(error).__name__


def drop_output() -> None:
    """Redirect stdout to nowhere, so that Python's flush at exit does not fail again."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
