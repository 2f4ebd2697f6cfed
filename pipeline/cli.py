"""The command line: which command, what is wrong in one line, and the exit code. Each command has its own file."""

import argparse
import io
import os
import re
import sys
import warnings
from collections.abc import Sequence
from concurrent.futures import BrokenExecutor
from typing import Any, NoReturn

from pipeline.commands import check, design, doctor, explain, run, suggest, view
from pipeline.commands.console import (
    EXIT_CODES,
    FAILED,
    PASSED,
    WRONG_INPUT,
    drop_output,
    print_error,
    reason_of,
)
from pipeline.commands.measuring import calibrate, modulus, read
from pipeline.commands.studying import optimise, study
from pipeline.storage.interrupts import ended_by
from sensor.quantity import InputError, nearest

COMMANDS: dict[str, Any] = {
    "run": run, "design": design, "suggest": suggest, "explain": explain, "check": check, "view": view,
    "doctor": doctor, "modulus": modulus, "calibrate": calibrate, "read": read,
    "study": study, "optimise": optimise,
}  # fmt: skip
"""Modules with PURPOSE, EXAMPLE, `add_arguments` and `execute`."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code; without words take those of the process, and make it fit to run.

    Raises KeyboardInterrupt where a signal ended the command, whatever a library made of it.
    """
    if argv is None:
        _prepare_process()
    try:
        words = sys.argv[1:] if argv is None else list(argv)
        arguments = _arguments(words)
        code: int = PASSED if arguments is None else COMMANDS[words[0]].execute(arguments)
        sys.stdout.flush()
    except InputError as error:
        message = str(error)
    except BrokenPipeError:
        drop_output()
        return FAILED
    except OSError as error:
        message = str(error)
        if error.errno is not None or not message:
            name = error.filename or "output"
            message = f"{name}: {reason_of(error)}; must be usable and have room; free some, or choose another"
    except MemoryError:
        message = "memory: too little; must be about 2 GiB; free some, or lift its limit"
    except BrokenExecutor:
        message = "worker process: ended before it answered; must live until then; free some memory, then run again"
    else:
        return code
    if ended_by() is not None:
        raise KeyboardInterrupt
    print_error(message)
    return WRONG_INPUT


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


def _arguments(words: list[str]) -> argparse.Namespace | None:
    """Return what the words ask of their command, the first of them; None where they are answered already."""
    parser, parsers = command_parsers()
    if not words or words[0] in ("-h", "--help"):
        print(parser.format_help(), end="")  # argparse would be quiet where it cannot print
        return None
    if words[0] == "--version":
        from importlib.metadata import version

        print(f"twintip {version('twintip')}")
        return None
    if words[0] not in parsers:
        kind = "flag" if words[0].startswith("-") else "command"
        raise _unknown(kind, words[0], ("--help", "--version") if kind == "flag" else (*parsers,))
    chosen = parsers[words[0]]
    if "-h" in words or "--help" in words:
        print(chosen.format_help(), end="")
        return None
    arguments, rest = chosen.parse_known_intermixed_args(words[1:])
    if rest and rest[0].startswith("-"):
        raise _unknown("flag", rest[0], chosen.flags)
    if rest:
        msg = f"{rest[0]!r} must be a flag or its value. Remove it, or see {chosen.prog} -h."
        raise InputError(msg)
    return arguments


def _unknown(kind: str, word: str, known: Sequence[str]) -> InputError:
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
    """Return the parser of the command line and that of each command by its name."""
    parser = _Parser(
        prog="pipeline",
        description="Design a two-spring tactile sensor for fruit and prove it by finite elements.",
        epilog=f"example: pipeline run --nl 0.05 --p-max 5      each command has its own -h\n{EXIT_CODES}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="store_true", help="print the version")
    adder = parser.add_subparsers(metavar="COMMAND", parser_class=_Parser)
    parsers = {}
    for name, command in COMMANDS.items():
        parsers[name] = adder.add_parser(
            name,
            help=command.PURPOSE,
            description=f"{command.PURPOSE[0].upper()}{command.PURPOSE[1:]}.",
            epilog=f"example: {command.EXAMPLE}\n{EXIT_CODES}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
            allow_abbrev=False,
        )
        command.add_arguments(parsers[name])
    return parser, parsers
