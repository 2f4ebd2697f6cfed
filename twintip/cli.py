"""The command line: it selects a command, prints its answers or an error in one line, and returns the exit code.

`twintip/flags.py` defines the flags of each command. The module that runs a command is imported only after its flags
have been parsed.
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

from pipeline.storage.interrupts import ending_signal
from sensor.gone import refuse_removed
from sensor.quantity import InputError, unknown_name, validation_error
from twintip.commands.console import (
    EXIT_CODES,
    FAILED,
    PASSED,
    WRONG_INPUT,
    Answer,
    discard_output,
    print_answer,
    print_error,
    printing_answer,
    reason_of,
)
from twintip.flags import COMMANDS

_COMPLETION = "--completion"


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command, print its answers as they arrive, and return the exit code of the last answer.

    `argv` holds the command and its flags. If it is None, they are the arguments of the process, whose threads,
    warnings and streams are then set up first. An error that the user can correct is printed as one line.

    Raises KeyboardInterrupt if a signal ended the command, even if a library converted the interruption to another
    error.
    """
    if argv is None:
        _prepare_process()
    try:
        words = sys.argv[1:] if argv is None else list(argv)
        help_text = _requested_help(words)
        if help_text is None:
            code = _run_command(words[0], words[1:])
        else:
            with printing_answer():  # argparse itself would not report that the text could not be printed
                print(help_text, end="")
            code = PASSED
        sys.stdout.flush()
    except BrokenPipeError:  # the program that reads the output has ended
        discard_output()
        return FAILED
    except (InputError, OSError, MemoryError, BrokenExecutor) as error:
        if ending_signal() is not None:  # a library converted the interruption to this error
            raise KeyboardInterrupt from error
        print_error(_error_line(error))
        return WRONG_INPUT
    return code


def _run_command(name: str, words: list[str]) -> int:
    """Run the command called `name`, print its answers, and return the exit code of the last answer.

    `words` are the flags of the command and their values. Raises InputError for wrong flags or another wrong input.
    """
    arguments = _parse_arguments(name, words)
    command: Any = import_module(COMMANDS[name].module)  # imported late, because most modules are slow to load
    result: Answer | Iterator[Answer] = command.run(arguments)  # some commands yield several answers
    answers = [result] if isinstance(result, Answer) else result
    code = PASSED
    for answer in answers:
        print_answer(answer, as_json=getattr(arguments, "json", False))
        code = answer.code
    return code


def _error_line(error: Exception) -> str:
    """Return the line that reports an error to the user: what is wrong, and what to do."""
    if isinstance(error, MemoryError):
        return "The program ran out of memory. A run needs about 2 GiB: free some memory, or raise its limit."
    if isinstance(error, BrokenExecutor):
        return "A worker process died, probably for lack of memory. Free some memory and run the command again."
    message = str(error)
    # The message of an InputError is such a line already. So is the message of an OSError that this program raises,
    # which has no error number.
    if not isinstance(error, OSError) or (error.errno is None and message):
        return message
    name = error.filename or "output"
    return f"{name}: {reason_of(error)}. Check that it is usable and has free space, or choose another one."


def _prepare_process() -> None:
    """Set up the threads, warnings and streams of the process, and the width of the terminal.

    The function changes environment variables, which child processes inherit.
    """
    # The order of summation, and therefore the last digits, depends on the number of threads.
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    warnings.simplefilter("ignore")  # the warnings of libraries do not help the user of a command
    os.environ["PYTHONWARNINGS"] = "ignore"  # for child processes, such as loky's resource tracker
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        # Python sets a stream to None if the shell has closed it. The next file to be opened would get its file
        # descriptor, so the null device takes its place.
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_RDWR), mode, encoding="utf-8"))
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # characters that the terminal cannot show become ?
    if not re.fullmatch(r"[0-9]{1,4}", os.environ.get("COLUMNS", "")):
        os.environ.pop("COLUMNS", None)  # rich would accept any number as a width


def _requested_help(words: list[str]) -> str | None:
    """Return the text that a help, version or completion flag prints, or None if the arguments have no such flag.

    `words` are the arguments of the program. Without arguments, the text is the same as for `--help`, which lists the
    commands. Raises InputError for an unknown shell after `--completion`.
    """
    first = words[0] if words else "--help"
    if first in ("-h", "--help"):
        return front_parser().format_help()
    if first == "--version":
        from importlib.metadata import version  # slow to import, and not needed by other commands

        return f"twintip {version('twintip')}\n"
    if first.partition("=")[0] == _COMPLETION:
        return completion(words)
    has_help_flag = "-h" in words or "--help" in words  # anywhere, even after flags that are wrong
    if first in COMMANDS and has_help_flag:
        return command_parser(first).format_help()
    return None


def completion(words: list[str]) -> str:
    """Return the script that completes commands and flags in a shell.

    `words` are the arguments of the program: `--completion=SHELL`, or `--completion` and the shell. Raises InputError
    for an unknown shell.
    """
    from twintip.completion import SHELLS, CompletedParser, completion_script

    shell = words[0].partition("=")[2] or "".join(words[1:])
    if shell not in SHELLS:
        hint = f'for instance: eval "$(pipeline {_COMPLETION} bash)"'
        raise validation_error(_COMPLETION, shell, "", f"one of {', '.join(SHELLS)}", hint)
    return completion_script(front_parser(CompletedParser), shell)


def _parse_arguments(command: str, words: list[str]) -> argparse.Namespace:
    """Parse the `words` after a command, which are its flags and their values.

    Raises InputError for an unknown command or flag, with the closest known name in the message. InputError is also
    raised for a removed flag, and for a word that is neither a flag nor the value of one.
    """
    if command.startswith("-") and command not in COMMANDS:
        raise unknown_name("flag", _flag(command), ["--help", "--version", _COMPLETION])
    if command not in COMMANDS:
        raise unknown_name("command", _flag(command), [*COMMANDS])
    parser = command_parser(command)
    # Removed flags are refused before unknown ones, because the message about a removed flag states what replaces it.
    refuse_removed(*(f"{parser.prog} {_flag(word)}" for word in words))
    arguments, unknown_words = parser.parse_known_intermixed_args(words)
    if unknown_words:
        first = unknown_words[0]
        if first.startswith("-"):
            raise unknown_name("flag", _flag(first), parser.flags)
        msg = f"{first!r} must be a flag or the value of one. Remove it, or see {parser.prog} -h."
        raise InputError(msg)
    return arguments


def _flag(word: str) -> str:
    """Return the flag in a word such as `--out=DIR`, without the equals sign and the value."""
    return word.partition("=")[0]


class _Parser(argparse.ArgumentParser):
    """An argparse parser that reports an error in one line, without printing the usage."""

    def __init__(self, prog: str, description: str, example: str) -> None:
        """Create a parser whose help ends with an example and the exit codes.

        `prog` is the command as it is typed, for example "pipeline run".
        """
        codes = [f"{code:d} {meaning}" for code, meaning in EXIT_CODES.items()]
        # One line is too short for all codes. The first three are outcomes, and the others are interruptions.
        code_lines = f"exit code: {', '.join(codes[:3])},\n           {', '.join(codes[3:])}"
        super().__init__(
            prog=prog,
            description=description,
            epilog=f"example: {example}\n{code_lines}",
            formatter_class=argparse.RawDescriptionHelpFormatter,  # keeps the line breaks
            allow_abbrev=False,
            add_help=False,  # the flag is added below, with a help text in the style of the other flags
        )
        self.add_argument("-h", "--help", action="help", help="Show this help and exit")

    @property
    def flags(self) -> list[str]:
        """Return the flags that begin with two dashes."""
        return [flag for flag in self._option_string_actions if flag.startswith("--")]

    def error(self, message: str) -> NoReturn:
        """Raise InputError instead of printing the usage and exiting."""
        advice = " Write FLAG=VALUE for a value that begins with -." if "expected one argument" in message else ""
        msg = f"{message.removeprefix('argument ')}.{advice} See the example in {self.prog} -h."
        raise InputError(msg)


def command_parser(name: str) -> _Parser:
    """Return the parser for the flags of one command."""
    command = COMMANDS[name]
    parser = _Parser(f"pipeline {name}", f"{command.purpose[0].upper()}{command.purpose[1:]}.", command.example)
    command.add_flags(parser)
    return parser


def front_parser(command_parser_class: type[argparse.ArgumentParser] | None = None) -> _Parser:
    """Return the parser whose help lists the commands, each with its purpose but without its flags.

    If `command_parser_class` is given, each command has a parser of this class with all its flags. The script for
    completion is generated from these parsers.
    """
    example = "pipeline run --nl 0.05 --p-max 5      each command has its own -h"
    purpose = "Design a two-spring tactile sensor for fruit and prove it by finite elements."
    parser = _Parser("pipeline", purpose, example)
    parser.add_argument("--version", action="store_true", help="Print the version and exit")
    help_text = "Print the script for completion with the Tab key in bash, zsh or fish"
    parser.add_argument(_COMPLETION, metavar="SHELL", help=help_text)
    commands = parser.add_subparsers(metavar="COMMAND", parser_class=command_parser_class or argparse.ArgumentParser)
    for name, command in COMMANDS.items():
        subparser = commands.add_parser(name, help=command.purpose)
        if command_parser_class is not None:
            command.add_flags(subparser)
    return parser
