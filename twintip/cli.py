"""The command line: which command, its answer, what is wrong in one line, and the exit code.

`twintip/flags.py` has the flags of each command. The file that runs it is imported once they are parsed.
"""

import argparse
import io
import os
import re
import sys
import warnings
from collections.abc import Iterator, Sequence
from concurrent.futures import BrokenExecutor
from importlib import import_module
from typing import Any, NoReturn

from pipeline.storage.interrupts import ended_by
from sensor.gone import refuse_gone
from sensor.quantity import InputError, nearest
from twintip.commands.console import (
    EXIT_CODES,
    FAILED,
    PASSED,
    WRONG_INPUT,
    Answer,
    answering,
    drop_output,
    print_answer,
    print_error,
    reason_of,
)
from twintip.flags import COMMANDS


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code.

    Without `argv` its words are those of the process, whose threads and streams are then prepared. Raises
    KeyboardInterrupt where a signal ended the command, whatever error a library made of it.
    """
    if argv is None:
        _prepare_process()
    try:
        words = sys.argv[1:] if argv is None else list(argv)
        arguments = _parsed(words)
        code = PASSED if arguments is None else _answered(words[0], arguments)
        sys.stdout.flush()
    except BrokenPipeError:  # whoever read the output has left
        drop_output()
        return FAILED
    except (InputError, OSError, MemoryError, BrokenExecutor) as error:
        if ended_by() is not None:
            raise KeyboardInterrupt from error
        print_error(_error_line(error))
        return WRONG_INPUT
    return code


def _answered(name: str, arguments: argparse.Namespace) -> int:
    """Run a command, print its answers as they come, and return the exit code of the last one."""
    command: Any = import_module(COMMANDS[name].module)
    answers: Answer | Iterator[Answer] = command.run(arguments)
    code = PASSED
    for answer in [answers] if isinstance(answers, Answer) else answers:
        print_answer(answer, as_json=getattr(arguments, "json", False))
        code = answer.code
    return code


def _error_line(error: Exception) -> str:
    """Return the line that an error prints for a user."""
    if isinstance(error, MemoryError):
        return "Memory ran out. A run needs about 2 GiB: free some, or lift its limit."
    if isinstance(error, BrokenExecutor):
        return "A worker process died, probably out of memory. Free some memory and run the command again."
    message = str(error)
    if not isinstance(error, OSError) or (error.errno is None and message):
        return message
    name = error.filename or "output"
    return f"{name}: {reason_of(error)}. It must be usable and have room: free some, or choose another."


def _prepare_process() -> None:
    """Make the process fit to run: threads, warnings, streams, the width of a terminal."""
    os.environ["OPENBLAS_NUM_THREADS"] = "1"  # the order of sums, and the last digits, follow the number of threads
    warnings.simplefilter("ignore")  # those of libraries are for us, not for who calls a command
    os.environ["PYTHONWARNINGS"] = "ignore"  # also in processes that are started, like loky's resource tracker
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:  # closed by the shell: the next file that is opened would take its number
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_RDWR), mode, encoding="utf-8"))
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # letters that a terminal lacks
    if not re.fullmatch(r"[0-9]{1,4}", os.environ.get("COLUMNS", "")):
        os.environ.pop("COLUMNS", None)  # rich would take any digits for a width


def _print_answer(text: str) -> None:
    """Print a text; raises InputError where it is lost, of which argparse itself would say nothing."""
    with answering():
        print(text, end="")


def _parsed(words: list[str]) -> argparse.Namespace | None:
    """Return the arguments of the command that the first word names; None where help or the version was printed.

    Raises InputError for an unknown command or flag, with the nearest known one, and for a flag that is gone.
    """
    parser, parsers = command_parsers()
    if not words or words[0] in ("-h", "--help"):
        _print_answer(parser.format_help())
        return None
    if words[0] == "--version":
        from importlib.metadata import version

        _print_answer(f"twintip {version('twintip')}\n")
        return None
    if words[0] not in parsers:
        kind = "flag" if words[0].startswith("-") else "command"
        raise _unknown(kind, words[0], ("--help", "--version") if kind == "flag" else (*parsers,))
    chosen = parsers[words[0]]
    if "-h" in words or "--help" in words:
        _print_answer(chosen.format_help())
        return None
    for word in words[1:]:
        refuse_gone(f"{chosen.prog} {word.partition('=')[0]}")
    arguments, rest = chosen.parse_known_intermixed_args(words[1:])
    if rest and rest[0].startswith("-"):
        raise _unknown("flag", rest[0], chosen.flags)
    if rest:
        msg = f"{rest[0]!r} must be a flag or its value. Remove it, or see {chosen.prog} -h."
        raise InputError(msg)
    return arguments


def _unknown(kind: str, word: str, known: Sequence[str]) -> InputError:
    """Return the error for an unknown word of a kind, with all known ones and the nearest."""
    given = word.partition("=")[0]
    bound = f"one of {', '.join(known)}"
    return InputError(f"{given} is an unknown {kind}; it must be {bound}. Did you mean {nearest(given, known)}?")


class _Parser(argparse.ArgumentParser):
    """Argparse without its usage noise: an error is one line, as everywhere else."""

    @property
    def flags(self) -> list[str]:
        """Return the long flags."""
        return [flag for flag in self._option_string_actions if flag.startswith("--")]

    def error(self, message: str) -> NoReturn:
        """Raise InputError instead of printing the usage and leaving."""
        dashed = " Write FLAG=VALUE for a value that begins with -." if "expected one argument" in message else ""
        msg = f"{message.removeprefix('argument ')}.{dashed} See the example of {self.prog} -h."
        raise InputError(msg)


def command_parsers() -> tuple[_Parser, dict[str, _Parser]]:
    """Return the parser of the command line, which prints its help, and by name the parser of each command."""
    codes = [f"{code:d} {meaning}" for code, meaning in EXIT_CODES.items()]
    told_codes = f"exit code: {', '.join(codes[:3])},\n           {', '.join(codes[3:])}"
    parser = _Parser(
        prog="pipeline",
        description="Design a two-spring tactile sensor for fruit and prove it by finite elements.",
        epilog=f"example: pipeline run --nl 0.05 --p-max 5      each command has its own -h\n{told_codes}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="store_true", help="print the version")
    adder = parser.add_subparsers(metavar="COMMAND", parser_class=_Parser)
    parsers = {}
    for name, command in COMMANDS.items():
        parsers[name] = adder.add_parser(
            name,
            help=command.purpose,
            description=f"{command.purpose[0].upper()}{command.purpose[1:]}.",
            epilog=f"example: {command.example}\n{told_codes}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
            allow_abbrev=False,
        )
        command.add_flags(parsers[name])
    return parser, parsers
