"""`pipeline suggest`: the nearest design that passes, as a command, a table and a design file."""

import dataclasses
import shlex
from argparse import ArgumentParser, Namespace
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from cad.design.design_file import design_as_mapping, design_as_toml, every_key
from cad.quantity import nearest, validation_error
from pipeline.commands.console import (
    FAILED,
    PASSED,
    add_force_flag,
    add_json_flag,
    answering,
    print_json,
    refusing_what_cannot_be_solved,
    showing_progress,
)
from pipeline.commands.run import add_design_flags, named_design, settings_of
from pipeline.options import DEFAULT_DESIGN, RunOptions, load_design

if TYPE_CHECKING:
    from pipeline.study.suggest.suggestion import Suggestion

PURPOSE = "find the nearest design that passes"
EXAMPLE = "pipeline suggest --fruit 'radius 26, E 0.3 to 2' --out kiwi.toml"
FRUIT_PRESET = "mango"  # the sensor that --fruit starts from


def add_arguments(parser: ArgumentParser) -> None:
    """Add DESIGN, the flags that give a design, --keep, --out and --json."""
    add = parser.add_argument
    add_design_flags(parser)
    words = (
        "find a sensor for this fruit instead, by the preset mango: 'radius 26, E 0.3 to 2' [mm, MPa] or a .json file"
    )
    add("--fruit", metavar="TEXT|FILE.json", help=f"{words} of pipeline modulus --json")
    add("--keep", metavar="TABLE.KEY", action="append", default=[], help="a key that stays as it is; repeatable")
    add("--out", metavar="FILE.toml", type=Path, help="write the design that passes there")
    add_force_flag(parser)
    add_json_flag(parser)


def execute(arguments: Namespace) -> int:
    """Search, prove and print; return 0 where a design passes, 1 where none was found."""
    named = named_design(arguments) if arguments.fruit is None else _preset_for_a_fruit(arguments)
    settings = settings_of(arguments)
    design = load_design(named, settings)
    for key in arguments.keep:
        if key not in every_key():
            hint = f"did you mean {nearest(key, every_key())}?"
            raise validation_error("--keep", key, "", "a key of the design file", hint)
    if arguments.out is not None:
        _refuse_out(arguments.out, force=arguments.force)
    from pipeline.study.suggest.fruit_range import fruit_range

    fruit = None if arguments.fruit is None else fruit_range(arguments.fruit)
    from pipeline.study.suggest.fruit_design import fruit_suggestion
    from pipeline.study.suggest.suggestion import suggestion

    with showing_progress("start", quiet=arguments.json) as progress, refusing_what_cannot_be_solved():
        if fruit is None:
            found = suggestion(design, RunOptions(), frozenset(arguments.keep), progress)
        else:
            name = design.name if arguments.out is None else arguments.out.stem
            design = dataclasses.replace(design, name=name)
            found = fruit_suggestion(fruit, design, frozenset({*arguments.keep, *settings}), progress)
    command = command_of(named, settings, found)
    with answering():
        if arguments.json:
            print_json(_as_mapping(found, command))
        else:
            _print(found, command)
    if found.changes is None:
        return FAILED
    if arguments.out is not None:
        _write(arguments, f"# {command}\n{design_as_toml(found.changed)}")
    return PASSED


def _preset_for_a_fruit(arguments: Namespace) -> str:
    """Return the preset that a fruit's sensor starts from; raises InputError where a design is named beside it."""
    named = named_design(arguments)
    if named != DEFAULT_DESIGN:
        raise validation_error("DESIGN", named, "", "left out beside --fruit", f"the search starts from {FRUIT_PRESET}")
    return FRUIT_PRESET


def _write(arguments: Namespace, text: str) -> None:
    from pipeline.storage.files import write_files

    write_files({arguments.out: text.encode()}, "--out", force=arguments.force)
    if not arguments.json:
        with answering():
            print(f"written to {arguments.out}")


def _refuse_out(path: Path, *, force: bool) -> None:
    """Raise InputError, before the search, for a file that could not be written after it."""
    from pipeline.storage.files import refuse_taken

    if path.suffix != ".toml":
        bound = "a file that ends in .toml"
        raise validation_error("--out", str(path), "", bound, "name a design file, not a folder")
    refuse_taken([path], "--out", force=force)


def command_of(design: str, settings: Mapping[str, str], found: "Suggestion") -> str:
    """Return the command that runs the design that was found; flags that set keys are `--set` there."""
    from pipeline.study.suggest.changes import written

    words = ["pipeline", "run", "--design", design]
    changes = {key: written(value) for key, value in (found.changes or {}).items()}
    for key, value in {**settings, **changes}.items():
        words += ["--set", f"{key}={value}"]
    return shlex.join(words)


def _as_mapping(found: "Suggestion", command: str) -> dict[str, object]:
    from pipeline.study.suggest.changes import value_of

    changes = []
    for key, value in (found.changes or {}).items():
        changes.append({"key": key, "from": value_of(found.design, key), "to": value})
    return {
        "design": design_as_mapping(found.changed),
        "passes": found.changes is not None,
        "changes": changes,
        "command": None if found.changes is None else command,
        "reason": found.reason,
        "tried": found.tried,
        "runs": found.runs,
        "verdicts": [dataclasses.asdict(verdict) for verdict in found.verdicts],
    }


def _print(found: "Suggestion", command: str) -> None:
    """Print what changes and the command, or which verdicts no change mends."""
    from pipeline.study.suggest.changes import value_of

    print(f"{found.design.name}: {found.reason}")
    if found.changes is None:
        for verdict in found.verdicts:
            if verdict.passed is not True:
                outcome = "undecided" if verdict.passed is None else "failed"
                print(f"{outcome} {verdict.name}: {verdict.reference}")
        return
    rows = [("key", "from", "to")] if found.changes else []
    for key, value in found.changes.items():
        rows.append((key, _formatted(value_of(found.design, key)), _formatted(value)))
    for key, before, after in rows:
        print(f"{key:<28}{before:<{_widest(rows)}}{after}")
    print(command)


def _widest(rows: list[tuple[str, str, str]]) -> int:
    return max(12, *(len(before) for _, before, _ in rows)) + 2


def _formatted(value: object) -> str:
    if value is None:
        return "not set"
    return f"{value:.6g}" if isinstance(value, float) else str(value)
