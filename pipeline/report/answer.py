"""The answer of a run on the terminal, from its report.json: a summary that fits on one screen, or all tables."""

from collections.abc import Iterator
from pathlib import Path

from rich.console import RenderableType
from rich.markup import escape
from rich.table import Table

from pipeline.report.verdict_table import OUTCOME, reason_lines, verdict_table
from pipeline.storage.digests import Json
from pipeline.verdicts.in_words import failed_or_undecided, is_on_the_part
from sensor.verdict import Verdict, all_passed
from sensor.words import OUTCOMES, value_text, value_with_bar

# Both maxima are judgements, which balance a complete answer against one that fits on one screen.
_MAX_REASONS = 3  # maximum number of lines on verdicts that did not pass; further verdicts are only counted
_MAX_NOTES = 5  # maximum total number of notes and lines on verdicts
_SHOWN_CAUSES = 2  # number of causes that the table of errors names for each number


def report_passed(report: Json) -> bool | None:
    """Return True if every verdict of a report passed, and False if one failed.

    If none failed but at least one is undecided, the result is None.
    """
    return all_passed(_verdicts(report))


def summary(report: Json, folder: Path) -> Iterator[RenderableType]:
    """Yield the tables and lines of an answer that fits on one screen; `print_parts` prints them.

    `report` is the data of report.json. The answer has the outcome, the verdicts on the targets, the springs, the first
    reasons and notes, and the files in `folder`. `every_section` yields the whole answer.
    """
    verdicts = _verdicts(report)
    problems = failed_or_undecided(verdicts)
    notes = report["notes"]
    yield _headline(report, verdicts)
    yield _target_table(verdicts)
    yield from _spring_lines(report)
    yield from reason_lines(problems[:_MAX_REASONS], in_table=lambda verdict: not is_on_the_part(verdict))
    if len(problems) > _MAX_REASONS:
        yield f"and {len(problems) - _MAX_REASONS} more: --verbose lists them all"
    # Each line on a verdict replaces a note, so that the answer fits on one screen. The + 1 is the line that counts the
    # further verdicts.
    verdict_lines = min(len(problems), _MAX_REASONS + 1)
    for note in notes[: _MAX_NOTES - verdict_lines]:
        yield f"- {escape(note)}"
    out = escape(str(folder))
    yield f"files in {out}: response.csv is the table P -> E, report.json has every number"
    yield f"look at it: open {escape(str(folder / 'report.html'))} in a browser, or pipeline view {out}"
    yield f"all verdicts, errors and {len(notes)} notes: --verbose"


def _target_table(verdicts: list[Verdict]) -> Table:
    """Return a table of the verdicts on the targets, with a single row that counts the verdicts on the printed part."""
    table = verdict_table("", [verdict for verdict in verdicts if not is_on_the_part(verdict)])
    part_outcomes = [verdict.passed for verdict in verdicts if is_on_the_part(verdict)]
    if part_outcomes:
        passed = f"{part_outcomes.count(True)} passed"
        table.add_row(f"{len(part_outcomes)} on geometry and print", "", "", "", passed)
    return table


def every_section(report: Json) -> Iterator[RenderableType]:
    """Yield the tables and lines of the whole answer, which --verbose shows; `print_parts` prints them.

    `report` is the data of report.json. The answer has every verdict, the springs, the sources of the errors, the
    paper's springs, all notes, and the times.
    """
    verdicts = _verdicts(report)
    yield _headline(report, verdicts)
    yield verdict_table(f"twintip · {escape(report['design']['name'])}", verdicts)
    yield from reason_lines(verdict for verdict in verdicts if verdict.passed is not True)
    yield from _spring_lines(report)
    yield _error_table(report)
    paper = report["paper"]
    if paper is not None:
        stiffnesses = f"{paper['K_l_N_per_m']:g} and {paper['K_h_N_per_m']:g} N/m"
        yield verdict_table(f"the paper's springs, {stiffnesses}, under the same contact", _verdicts(paper))
    lines = (*report["notes"], *_method_lines(report), *_scatter_lines(report), _cost_line(report))
    yield from map(escape, lines)


def _verdicts(data: Json) -> list[Verdict]:
    """Return the verdicts in a report, or in its part on the paper's springs."""
    return [Verdict(**entry) for entry in data["verdicts"]]


def _headline(report: Json, verdicts: list[Verdict]) -> str:
    """Return the first line: the outcome, the name of the design, and the numbers of failed and undecided verdicts."""
    outcomes = [verdict.passed for verdict in verdicts]
    # A failed verdict has the outcome False, and an undecided one has None.
    counts = [f"{outcomes.count(passed)} {OUTCOMES[passed]}" for passed in (False, None) if passed in outcomes]
    if counts:
        counts_text = f"of {len(verdicts)} verdicts {', '.join(counts)}"
    else:
        counts_text = f"all {len(verdicts)} verdicts passed"
    return f"{OUTCOME[all_passed(verdicts)]}  twintip · {escape(report['design']['name'])}: {counts_text}"


def _spring_lines(report: Json) -> Iterator[str]:
    """Yield a line for each spring: its stiffness with its error bar, its leaves, their strain and the strain limit.

    A layout without a housing has no flexures; a single line then shows the given stiffnesses.
    """
    if "flexures" not in report:
        K_l, K_h = (report["springs"][key] for key in ("K_l_N_per_m", "K_h_N_per_m"))
        yield f"springs: {K_l:.6g} and {K_h:.6g} N/m, exactly as given; a line of tips has no housing"
        return
    process = report["material"]["process"]
    for name, spring in report["flexures"].items():
        if spring["dimensions_mm"] is None:
            yield f"{name} spring: {spring['target_N_per_m']:.6g} N/m, not made"
            continue
        K = spring["stiffness_N_per_m"]
        stiffness = f"{value_with_bar(K, 0.01 * spring['error_percent'] * K, 'N/m')} by FE"
        yield escape(f"{name} spring: {stiffness}, {_leaf_text(spring, process)}")


def _leaf_text(spring: Json, process: str) -> str:
    """Return the leaves of a made spring as text: their size, the print process, and their strain at full travel."""
    leaf = spring["dimensions_mm"]
    size = f"{leaf['length']:g} x {leaf['thickness']:g} x {leaf['depth']:g} mm"
    strain = spring["root_strain"]
    # The safety factor is the strain limit divided by the strain, so their product is the limit.
    limit = "" if spring["safety_factor"] is None else f", limit {spring['safety_factor'] * strain:.2g}"
    return f"leaves {size} in {process}, strain {strain:.2g} at full travel{limit}"


def _error_table(report: Json) -> Table:
    """Return a table of the errors [%] of each number, due to the mesh, the model and the inputs.

    The last column names the causes with the largest absolute errors. A number without an error budget has no row.
    """
    columns = ("error of, at 95 %", "mesh ± %", "left out of the model %", "scatter of inputs ± %", "largest shares")
    table = Table(*columns)
    for name, budget in report["errors"].items():
        if budget is None:
            continue
        causes = [*budget["model"], *budget["inputs"]]
        causes.sort(key=lambda cause: abs(cause["size_percent"]), reverse=True)
        largest = [f"{cause['effect']} {cause['size_percent']:+.2g}" for cause in causes[:_SHOWN_CAUSES]]
        # the keys of the columns for the mesh, the model and the inputs, in the order of the headings
        totals = (budget[f"{key}_percent"] for key in ("discretisation", "model", "inputs"))
        table.add_row(name, *(value_text(total, digits=2) for total in totals), ", ".join(largest))
    return table


def _method_lines(report: Json) -> Iterator[str]:
    """Yield lines with the accuracy reached, the tolerance requested and the method, for contact and springs."""
    accuracy = report["accuracy"]
    for name in ("contact", "springs"):
        stage = accuracy[name]
        if stage is not None:
            yield f"{name} ± {stage['error_percent']:.2g} %, --tol {accuracy['tolerance']:g}: {stage['choice']}"


def _scatter_lines(report: Json) -> Iterator[str]:
    """Yield a line on the scatter of prints before calibration, and a line on the error of E after calibration.

    Nothing is yielded for a report without this scatter, because only `pipeline design` computes it.
    """
    scatter = report.get("tolerance")
    if scatter is None:
        return
    bands = []
    for name, band in scatter.items():
        if isinstance(band, list):  # the two ends of a band; the other values of `tolerance` are single numbers
            low, high = ("no limit" if end is None else f"{end:.4g}" for end in band)
            bands.append(f"{name} {low} to {high}")
    yield f"before calibration 95 % of prints have: {', '.join(bands)}"
    error = scatter["calibrated_modulus_error"]  # relative error [1]; None if it is unbounded
    accuracy_text = "not known" if error is None else f"known to {100.0 * error:.1f} %"
    yield f"with both stiffnesses of a unit known to 1 %, the modulus that it reads is {accuracy_text}"


def _cost_line(report: Json) -> str:
    """Return a line with the wall-clock and CPU time of each stage [s]."""
    cpu = report["cpu_seconds"]
    stages = [f"{name} {wall:.2f}/{cpu[name]:.2f}" for name, wall in report["seconds"].items()]
    return f"seconds (wall-clock/CPU): {', '.join(stages)}"
