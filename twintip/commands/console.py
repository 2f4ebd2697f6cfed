"""Output of all commands: answers, exit codes and one-line errors. A reader may have closed the pipe."""

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
    from rich.console import RenderableType  # imported only for type checking, because rich is slow to load

PASSED, FAILED, WRONG_INPUT = 0, 1, 2
_KEPT_LENGTH = 1500  # [characters] kept at each end of a very long message; other messages are shorter than twice this
EXIT_CODES = {
    PASSED: "all verdicts pass",
    FAILED: "a verdict fails or is undecided",
    WRONG_INPUT: "wrong input",
    128 + signal.SIGINT: "ended by Ctrl-C",
    128 + signal.SIGTERM: "ended by SIGTERM",
}
"""The meaning of each exit code. `__main__` returns the codes above 128."""


@dataclass(frozen=True, kw_only=True)
class Answer:
    """The answer of a command: its exit code, and what is printed.

    With `--json`, `data` is printed. Otherwise, `parts` are laid out by rich in `width` characters, and `text` is
    printed unchanged. A command that reads a stream yields an answer for each press, and its data are printed on one
    line. The paths of the written `files` are also printed: on stderr with `--json`, and otherwise on stdout.
    """

    code: int
    data: object = None
    text: str = ""
    parts: Iterable["RenderableType"] = ()
    width: int | None = None
    of_stream: bool = False
    files: Sequence[Path] = ()


def print_answer(answer: Answer, *, as_json: bool) -> None:
    """Print the data of an answer as JSON, or its parts and its text, and then the paths of its files.

    If nobody reads the output any more, it is discarded. A command that reads a stream is ended instead: this function
    then raises BrokenPipeError.
    """
    handling_errors = nullcontext() if answer.of_stream else printing_answer()
    with handling_errors:
        if as_json and answer.data is not None:
            print_json(answer.data, indent=None if answer.of_stream else 2)
        elif not as_json:
            if answer.parts:
                from pipeline.report.verdict_table import print_parts  # loads rich, which is slow

                print_parts(answer.parts, answer.width)
            if answer.text:
                print(answer.text)
        for path in answer.files:
            print(path, file=sys.stderr if as_json else sys.stdout)
        sys.stdout.flush()


def print_json(data: object, indent: int | None = 2) -> None:
    """Print data as JSON. Raises ValueError for a number that is not finite."""
    print(json.dumps(data, indent=indent, allow_nan=False, ensure_ascii=sys.stdout.encoding != "utf-8"))


@contextmanager
def printing_answer() -> Iterator[None]:
    """Flush stdout at the end of the block, which prints an answer.

    If nobody reads the output any more, it is discarded, because the work of the command is done. Raises InputError if
    the answer is lost for another reason, for instance because the disk is full.
    """
    try:
        yield
        sys.stdout.flush()
    except (BrokenPipeError, SystemExit):  # rich converts BrokenPipeError to SystemExit
        discard_output()
    except OSError as error:
        discard_output()
        msg = f"the answer cannot be printed: {reason_of(error)}. The work is done; free some space for its answer."
        raise InputError(msg) from error


@contextmanager
def solver_errors_as_input_errors() -> Iterator[None]:
    """Convert errors that the mesher, the solvers and the file writers raise in the block to InputError.

    The cause of such an error is a design outside the range of the methods.
    """
    # These imports load the mesher and the solvers, which many commands do not need.
    from cad.files.export_error import ExportError
    from mesh.session import MeshError
    from solve.linear import SolveError

    try:
        yield
    except (ExportError, MeshError, SolveError) as error:
        raise InputError(str(error)) from error


def print_error(message: str) -> None:
    """Print a message to stderr as one line, with control characters escaped. Failure to print is ignored."""
    line = " ".join(message.split())
    # A message may quote a very long name or value of the user. Its end is kept, because the hint is there.
    if len(line) > 2 * _KEPT_LENGTH:
        line = f"{line[:_KEPT_LENGTH]} ... {line[-_KEPT_LENGTH:]}"
    escaped = "".join(letter if letter.isprintable() else repr(letter)[1:-1] for letter in line)
    with suppress(OSError):
        print(f"pipeline: {escaped}", file=sys.stderr, flush=True)


def reason_of(error: OSError) -> str:
    """Return the system's description of an error, or the library's message, or else the type of the error."""
    return error.strerror or str(error) or type(error).__name__


def discard_output() -> None:
    """Redirect stdout to the null device, so that Python's flush at exit does not fail again."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
