"""How every command speaks: its answer, its exit codes, and what happens when the reader has left."""

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
    from rich.console import RenderableType  # which help and refusals do without

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


@dataclass(frozen=True, kw_only=True)
class Answer:
    """What a command answers: the exit code so far, and the data of `--json` or what is printed without it.

    `text` is printed as it is, `parts` are laid out by rich in `width` letters. A command that reads a stream yields an
    answer for each press: its data stand on one line. `files` were written; beside data their paths stand on stderr.
    """

    code: int
    data: object = None
    text: str = ""
    parts: Iterable["RenderableType"] = ()
    width: int | None = None
    of_stream: bool = False
    files: Sequence[Path] = ()


def print_answer(answer: Answer, *, as_json: bool) -> None:
    """Print an answer. A reader that has left undoes no work, but ends the reading of a stream: BrokenPipeError."""
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
    """Print data as JSON; raises ValueError when a number is not finite."""
    print(json.dumps(data, indent=indent, allow_nan=False, ensure_ascii=sys.stdout.encoding != "utf-8"))


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
