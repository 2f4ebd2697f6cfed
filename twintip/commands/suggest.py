"""`pipeline suggest`: the nearest design that passes its verdicts, as a command, a table and a design file."""

import dataclasses
import shlex
from argparse import Namespace
from typing import TYPE_CHECKING

from pipeline.options import DEFAULT_DESIGN, RunOptions, load_design, setting_text
from pipeline.storage.digests import Json
from pipeline.storage.files import check_paths_are_free, write_files
from pipeline.verdicts.in_words import value_and_limit
from sensor.design.design_file import design_as_mapping, design_as_toml, every_key
from sensor.design.parameters import Design
from sensor.gone import refuse_removed
from sensor.quantity import nearest, validation_error
from sensor.words import OUTCOMES, value_text
from twintip.commands.console import (
    FAILED,
    PASSED,
    Answer,
    solver_errors_as_input_errors,
)
from twintip.commands.progress import showing_progress
from twintip.commands.run import collect_settings, named_design

if TYPE_CHECKING:
    from pipeline.find.fruit_range import FruitRange
    from pipeline.find.suggestion import Suggestion


def run(arguments: Namespace) -> Answer:
    """Search for the nearest design that passes, and verify it by a run. The exit code is 0 if there is one, else 1.

    With `--fruit`, the search starts from the preset for the most similar fruit. If no design passes for this fruit,
    the answer names the most similar fruit for which one passes.
    """
    fruit, preset_or_file = _starting_point(arguments)
    settings = collect_settings(arguments)
    design = load_design(preset_or_file, settings)
    _check_flags(arguments)
    suggestion, nearest_fruit = _search(arguments, design, fruit, preset_or_file, frozenset(settings))
    changes = _change_rows(suggestion)
    lines = _suggestion_lines(suggestion, changes)
    if fruit is not None and suggestion.changes is None:
        lines.append(_nearest_fruit_line(nearest_fruit, preset_or_file, arguments, settings))
    command = None
    if suggestion.changes is not None:  # a design passes, perhaps without any change
        if fruit is not None and fruit.thickness_mm is None:
            lines.append(_assumed_thickness_line(suggestion.changed))
        command = _run_command(preset_or_file, settings, changes)
        lines.append(command)
        if arguments.out is not None:
            # The first line of the design file is a comment with the command.
            content = f"# {command}\n{design_as_toml(suggestion.changed)}".encode()
            write_files({arguments.out: content}, "--out", force=arguments.force)
            lines.append(f"written to {arguments.out}")
    starting_preset = None if fruit is None else preset_or_file
    data = _suggestion_data(suggestion, changes, command, starting_preset, nearest_fruit)
    return Answer(code=FAILED if command is None else PASSED, data=data, text="\n".join(lines))


def _suggestion_data(
    suggestion: "Suggestion",
    changes: list[Json],
    command: str | None,
    starting_preset: str | None,
    nearest_fruit: "FruitRange | None",
) -> Json:
    """Return the data of the answer for `--json`.

    `changes` are the rows of the table of changed keys. `command` runs the suggested design, and is None if no design
    passes. `starting_preset` is None unless the search was for a fruit.
    """
    return {
        "design": design_as_mapping(suggestion.changed),
        "passes": command is not None,
        "changes": changes,
        "command": command,
        "reason": suggestion.reason,
        "preset": starting_preset,
        "nearest_fruit": None if nearest_fruit is None else nearest_fruit.in_words,
        "tried": suggestion.tried,
        "runs": suggestion.runs,
        "verdicts": [dataclasses.asdict(verdict) for verdict in suggestion.verdicts],
    }


def _assumed_thickness_line(design: Design) -> str:
    """Return the line on the assumed thickness of the flesh, for a fruit whose range of thickness was not given."""
    depth = f"{design.fruit.depth_mm:g} mm"
    return f"The flesh is taken to be {depth} thick. Give its range to --fruit, as in 'flesh 14 to 27'."


def _starting_point(arguments: Namespace) -> "tuple[FruitRange | None, str]":
    """Return the fruit given by `--fruit`, or None, and the preset or design file from which the search starts.

    For a fruit, this is the preset that is most similar to it. Raises InputError if both a fruit and a design are
    given, or if the fruit is invalid.
    """
    preset_or_file = named_design(arguments)
    if arguments.fruit is None:
        return None, preset_or_file
    # These imports load the solvers, which is slow, so they are made only for a fruit.
    from pipeline.find.fruit_design import PRESETS, fruit_range_of_design, most_similar_preset
    from pipeline.find.fruit_range import fruit_range

    if preset_or_file != DEFAULT_DESIGN:
        hint = "give only one of them, because --fruit starts from the most similar preset"
        raise validation_error("DESIGN", preset_or_file, "", "left out if --fruit is given", hint)
    is_preset = arguments.fruit in PRESETS
    fruit = fruit_range_of_design(load_design(arguments.fruit)) if is_preset else fruit_range(arguments.fruit)
    return fruit, most_similar_preset(fruit)


def _change_rows(suggestion: "Suggestion") -> list[Json]:
    """Return a row for each key that a suggestion changes: the key, its original value and its new value."""
    from pipeline.find.changes import value_of  # loads the solvers, which the search has already done

    changes = suggestion.changes or {}
    return [{"key": key, "from": value_of(suggestion.design, key), "to": value} for key, value in changes.items()]


def _run_command(preset_or_file: str, settings: dict[str, str], changes: list[Json]) -> str:
    """Return the command that runs a suggested design: the starting design with all settings and changes."""
    words = ["pipeline", "run", "--design", preset_or_file]
    changed_settings = {row["key"]: setting_text(row["key"], row["to"]) for row in changes}
    for key, text in {**settings, **changed_settings}.items():
        words += ["--set", f"{key}={text}"]
    return shlex.join(words)


def _check_flags(arguments: Namespace) -> None:
    """Raise InputError for an unknown key of `--keep`, or for a file that could not be written after the search."""
    refuse_removed(*arguments.keep)  # its message says what replaces a removed key
    for key in arguments.keep:
        if key not in every_key():
            hint = f"did you mean {nearest(key, every_key())}?"
            raise validation_error("--keep", key, "", "a key of the design file", hint)
    if arguments.out is None:
        return
    if arguments.out.suffix != ".toml":
        bound = "a file that ends in .toml"
        raise validation_error("--out", str(arguments.out), "", bound, "name a design file, not a folder")
    check_paths_are_free([arguments.out], "--out", force=arguments.force)


def _search(
    arguments: Namespace, design: Design, fruit: "FruitRange | None", preset_or_file: str, given: frozenset[str]
) -> "tuple[Suggestion, FruitRange | None]":
    """Search for the nearest design that passes. If none passes for a fruit, find the most similar fruit that has one.

    The search starts from `design`, which is the preset or file named `preset_or_file` with the user's settings. The
    keys of `--keep` are never changed. In a search for a fruit, the keys in `given` are not changed either. The first
    result is the suggestion. The second result is the most similar fruit, or None if it is not needed or not found.
    """
    keep = frozenset(arguments.keep)
    with showing_progress("loading the solvers") as progress, solver_errors_as_input_errors():
        from pipeline.find.demand import nearest_demand
        from pipeline.find.fruit_design import fruit_suggestion
        from pipeline.find.suggestion import suggestion

        if fruit is None:
            return suggestion(design, RunOptions(), keep, progress), None
        progress(f"starting from the preset {preset_or_file}, scaled to the size of the fruit")
        # The suggested design is named after the file to which it is written.
        preset = dataclasses.replace(design, name=design.name if arguments.out is None else arguments.out.stem)
        found = fruit_suggestion(fruit, preset, keep | given, progress)
        if found.changes is not None:  # a design passes
            return found, None
        failed_or_undecided = [verdict for verdict in found.verdicts if verdict.passed is not True]
        return found, nearest_demand(fruit, failed_or_undecided, preset, keep | given, progress)


def _nearest_fruit_line(
    nearest_fruit: "FruitRange | None", preset_or_file: str, arguments: Namespace, settings: dict[str, str]
) -> str:
    """Return the line with the command that suggests a sensor for the most similar fruit for which a design passes.

    If `nearest_fruit` is None, the line reports that there is no such fruit. The command repeats the flags of this
    search, which started from `preset_or_file`: the `settings`, the kept keys and the output path.
    """
    if nearest_fruit is None:
        return f"no design was found for narrower ranges of the fruit either, from the preset {preset_or_file}"
    words = ["pipeline", "suggest", "--fruit", nearest_fruit.in_words]
    for key, text in settings.items():
        words += ["--set", f"{key}={text}"]
    for key in arguments.keep:
        words += ["--keep", key]
    if arguments.out is not None:
        words += ["--out", str(arguments.out)]
    return f"a design passes for narrower ranges of the fruit: {shlex.join(words)}"


def _suggestion_lines(suggestion: "Suggestion", changes: list[Json]) -> list[str]:
    """Return the lines on the outcome of a search: the reason, and a table of the changed keys.

    If no design passes, the verdicts that do not pass follow the reason instead. `changes` holds the key, its original
    value and its new value for each row of the table.
    """
    lines = [f"{suggestion.design.name}: {suggestion.reason}"]
    if suggestion.changes is None:
        for verdict in suggestion.verdicts:
            if verdict.passed is not True:
                outcome = OUTCOMES[verdict.passed]
                lines.append(f"{outcome} {verdict.name}: {value_and_limit(verdict)}{verdict.reference}")
    return [*lines, *_table_lines(changes)] if changes else lines


def _table_lines(changes: list[Json]) -> list[str]:
    """Return the lines of the table of changed keys, with a line of headings and left-aligned columns.

    `changes` holds the key, its original value ("from") and its new value ("to") for each row.
    """
    rows = [("key", "from", "to")]
    for change in changes:
        old_text, new_text = (value_text(change[end], digits=6, absent="not set") for end in ("from", "to"))
        rows.append((change["key"], old_text, new_text))
    widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
    lines = []
    for row in rows:
        cells = [cell.ljust(width) for cell, width in zip(row, widths, strict=True)]
        lines.append("  ".join(cells).rstrip())
    return lines
