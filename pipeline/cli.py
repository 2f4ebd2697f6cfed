"""The command line: flags to a design and options, one line for what is wrong, and the exit code.

Every import inside a function here waits on purpose: help and refusals are instant.
"""

import argparse
import errno
import json
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn

from cad.design.parameters import Design
from cad.quantity import InputError, fault, nearest
from pipeline.accuracy import DEFAULT_TOLERANCE, TOLERANCES
from pipeline.options import CONTACT_METHODS, DEFAULT_DESIGN, FRUIT_STIFFNESSES, RunOptions, load_design
from pipeline.storage.folder import Interrupted, refuse_unusable

PASSED, FAILED, WRONG_INPUT, INTERRUPTED = 0, 1, 2, 130
_FULL = {errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EFBIG}
_SETTING_OF = {"nl": "targets.NL", "p_max": "targets.P_max", "process": "print.process"}
_EXIT_CODES = "exit code: 0 all verdicts pass, 1 a verdict failed or is undecided, 2 the input or environment is wrong"


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code."""
    try:
        with _leaving_at_once():
            code = _command(sys.argv[1:] if argv is None else list(argv))
        sys.stdout.flush()
    except InputError as error:
        return _refuse(str(error))
    except BrokenPipeError:
        _drop_output()
        return FAILED
    except OSError as error:
        if error.errno not in _FULL:
            raise
        return _refuse(f"{error.filename or 'output'}: {error.strerror}; must have room; free some space")
    except KeyboardInterrupt as error:
        print("pipeline: interrupted", file=sys.stderr)
        return error.exit_code if isinstance(error, Interrupted) else INTERRUPTED
    return code


@contextmanager
def _leaving_at_once() -> Iterator[None]:
    """Let Ctrl-C end the process while nothing is written: inside an import it would come out as another error.

    `output_folder` puts its own handling in this one's place for as long as there is something to clear away.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.getsignal(signal.SIGINT)
    if before is signal.default_int_handler:
        signal.signal(signal.SIGINT, lambda *_: os._exit(INTERRUPTED))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _refuse(message: str) -> int:
    print("pipeline: " + " ".join(message.split()), file=sys.stderr)
    return WRONG_INPUT


def _drop_output() -> None:
    """Point stdout nowhere, so that Python's own flush at exit does not fail on the closed pipe again."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _command(words: list[str]) -> int:
    parser, commands = _parsers()
    if not words or words[0] in ("-h", "--help"):
        parser.print_help()
        return PASSED
    chosen = commands.get(words[0])
    if chosen is None:
        kind = "flag" if words[0].startswith("-") else "command"
        known = ("--help",) if kind == "flag" else tuple(commands)
        raise _unknown(kind, words[0], known)
    if "-h" in words or "--help" in words:
        chosen.print_help()
        return PASSED
    arguments, rest = chosen.parse_known_args(words[1:])
    if rest:
        if not rest[0].startswith("-"):
            msg = f"{rest[0]!r}: must be a flag or its value; remove it, or see {chosen.prog} -h"
            raise InputError(msg)
        raise _unknown("flag", rest[0], tuple(chosen.flags))
    run: Callable[[argparse.Namespace], int] = arguments.command
    return run(arguments)


def _unknown(kind: str, word: str, known: tuple[str, ...]) -> InputError:
    given = word.partition("=")[0]
    bound = f"one of {', '.join(known)}"
    return InputError(f"{given}: unknown {kind}; must be {bound}; did you mean {nearest(given, known)}?")


class _Parser(argparse.ArgumentParser):
    """Argparse without its usage noise: an error is one line, as everywhere else."""

    @property
    def flags(self) -> list[str]:
        """Return the long flags."""
        return [flag for flag in self._option_string_actions if flag.startswith("--")]

    def error(self, message: str) -> NoReturn:
        """Raise InputError instead of printing the usage and leaving."""
        msg = f"{message.removeprefix('argument ')}; must be as in the example of {self.prog} -h"
        raise InputError(msg)


def _parsers() -> tuple[_Parser, dict[str, _Parser]]:
    parser = _Parser(
        prog="pipeline",
        description="Design a two-spring tactile sensor for fruit and prove it by finite elements before printing.",
        epilog=f"example: pipeline run --nl 0.05 --p-max 5      each command has its own -h\n{_EXIT_CODES}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    adder = parser.add_subparsers(metavar="COMMAND", parser_class=_Parser)
    commands = {}

    def add(name: str, command: Callable[[argparse.Namespace], int], purpose: str, example: str) -> _Parser:
        found: _Parser = adder.add_parser(
            name,
            help=purpose,
            description=f"{purpose[0].upper()}{purpose[1:]}.",
            epilog=f"example: {example}\n{_EXIT_CODES}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
            allow_abbrev=False,
        )
        found.set_defaults(command=command)
        commands[name] = found
        return found

    run = add("run", _run, "size, shape, mesh, solve and judge a sensor", "pipeline run --nl 0.05 --out outputs/mine")
    _add_design_flags(run)
    design = add("design", _design, "make the files for fabrication and judge their geometry", "pipeline design")
    _add_design_flags(design)
    design.add_argument("--list-processes", action="store_true", help="print the print processes and leave")
    check = add("check", _check, "judge the geometry of files, own or foreign", "pipeline check outputs/paper")
    check.add_argument("path", metavar="PATH", type=Path, help="an output folder, or a STEP or STL file [mm]")
    _add_json(check)
    view = add("view", _view, "show the parts, fields and response", "pipeline view outputs/paper --png pictures")
    view.add_argument("folder", metavar="DIR", type=Path, help="an output folder")
    view.add_argument("--png", metavar="DIR", type=Path, help="write pictures there instead of opening a window")
    bench = add("bench", _bench, "measure speed against error on this machine", "pipeline bench")
    bench.add_argument("--hard", action="store_true", help="solve the hard cases instead; exit code 1 if one is wrong")
    bench.add_argument("--out", metavar="DIR", type=Path, help="folder of the tables (default outputs/bench)")
    _add_json(bench)
    add("doctor", _doctor, "look whether this machine has what the commands need", "pipeline doctor")
    return parser, commands


def _add_json(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--json", action="store_true", help="print JSON instead of tables")


def _add_design_flags(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add("--nl", metavar="NL", help="target nonlinearity [fraction, 0.05 = 5 %%], greater than 0 and less than 0.5")
    add("--p-max", metavar="P", help="target force ratio at the largest modulus [1], greater than 1 and at most 100")
    add("--design", metavar="NAME|FILE.toml", default=DEFAULT_DESIGN, help=f"preset or file (default {DEFAULT_DESIGN})")
    add("--process", metavar="NAME", help="print process, see pipeline design --list-processes")
    add("--set", metavar="TABLE.KEY=VALUE", action="append", default=[], help="any key of the design file; repeatable")
    add("--out", metavar="DIR", type=Path, help="the output folder itself (default outputs/NAME)")
    stiffnesses, methods = "|".join(FRUIT_STIFFNESSES), "|".join(CONTACT_METHODS)
    add("--fruit-stiffness", metavar=stiffnesses, default="contact", help="true contact, or the paper's (6)")
    add("--contact-method", metavar=methods, default="auto", help="how the contact is solved (default auto)")
    add("--tol", metavar="TOL", help=f"relative error allowed to both stiffnesses (default {DEFAULT_TOLERANCE:g})")
    add("--fields", action="store_true", help="write displacement [mm] and stress [MPa] fields too (VTU)")
    _add_json(parser)


def _settings(arguments: argparse.Namespace) -> dict[str, str]:
    """Return the design keys that flags set; raises InputError for one that is set twice."""
    settings: dict[str, str] = {}
    given = [(key, getattr(arguments, flag)) for flag, key in _SETTING_OF.items()]
    for text in arguments.set:
        key, equals, value = text.partition("=")
        if not equals:
            msg = f"--set = {text!r}: must be TABLE.KEY=VALUE; write for instance --set tips.side_mm=1.5"
            raise InputError(msg)
        given.append((key.strip(), value.strip()))
    for key, value in given:
        if value is None:
            continue
        if key in settings:
            msg = f"{key} = {value!r}: must be given once, and it is {settings[key]!r} already; keep one of the two"
            raise InputError(msg)
        settings[key] = value
    return settings


def _asked(arguments: argparse.Namespace) -> tuple[Design, RunOptions]:
    design = load_design(arguments.design, _settings(arguments))
    options = RunOptions(
        out=arguments.out or Path("outputs") / design.name,
        fruit_stiffness=arguments.fruit_stiffness,
        contact_method=arguments.contact_method,
        fields=arguments.fields,
        tolerance=_tolerance(arguments.tol),
    )
    refuse_unusable(options.out)
    return design, options


def _tolerance(text: str | None) -> float:
    try:
        return DEFAULT_TOLERANCE if text is None else float(text)
    except ValueError as error:
        raise fault("--tol", text, "", f"a number {TOLERANCES}", "0.001 is 0.1 %") from error


def _run(arguments: argparse.Namespace) -> int:
    design, options = _asked(arguments)
    from pipeline import run

    return _finish(run.run, design, options, as_json=arguments.json)


def _design(arguments: argparse.Namespace) -> int:
    if arguments.list_processes:
        from pipeline.commands import processes

        return processes.list_processes(as_json=arguments.json)
    design, options = _asked(arguments)
    from pipeline.stages import fabrication

    return _finish(fabrication.fabricate, design, options, as_json=arguments.json)


def _finish(stages: Callable[..., Any], design: Design, options: RunOptions, *, as_json: bool) -> int:
    """Run the stages, print the report, return the exit code; a scene that cannot be solved is wrong input."""
    from mesh.session import MeshError
    from pipeline.report import tables as report_tables
    from solve.fruit.split import SplitDomainError
    from solve.linear import SolveError

    try:
        result = stages(design, options)
    except (MeshError, SolveError, SplitDomainError) as error:
        raise InputError(str(error)) from error
    code = PASSED if result.passed else FAILED
    try:
        if as_json:
            _print_json(result.report)
        else:
            report_tables.print_report(result.report)
        sys.stdout.flush()
    except BrokenPipeError:
        _drop_output()  # the reader had enough; the verdict stands
    return code


def _print_json(data: object) -> None:
    print(json.dumps(data, indent=2, allow_nan=False, ensure_ascii=False))


def _check(arguments: argparse.Namespace) -> int:
    from pipeline.commands import check

    return check.check(arguments.path, as_json=arguments.json)


def _view(arguments: argparse.Namespace) -> int:
    from pipeline.commands import view

    return view.view(arguments.folder, arguments.png)


def _bench(arguments: argparse.Namespace) -> int:
    place = {} if arguments.out is None else {"out": arguments.out}
    from pipeline.bench import bench

    if not arguments.hard:
        return bench.bench(as_json=arguments.json, **place)
    from pipeline.bench.hard import suite as hard

    return hard.hard(as_json=arguments.json, **place)


def _doctor(_arguments: argparse.Namespace) -> int:
    from pipeline.commands import doctor

    return doctor.doctor()
