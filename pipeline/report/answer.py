"""The answer of a run on the terminal, from its report.json: a summary that fits on one screen, or all tables."""

from collections.abc import Iterator
from pathlib import Path

from rich.console import RenderableType
from rich.markup import escape
from rich.table import Table

from pipeline.report.verdict_table import OUTCOME, reason_lines, verdict_table
from pipeline.storage.digests import Json
from pipeline.verdicts.in_words import is_on_the_part, not_passed
from sensor.verdict import Verdict, all_passed
from sensor.words import OUTCOMES, value_text, value_with_bar

_REASONS = 3  # maximum number of lines on verdicts that did not pass; further verdicts are only counted
_NOTES = 5  # maximum number of notes and lines on verdicts together


def report_passed(report: Json) -> bool | None:
    """Return whether every verdict of a report passed; None if one is undecided and none failed."""
    return all_passed(_verdicts(report))


def summary(report: Json, folder: Path) -> Iterator[RenderableType]:
    """Yield the tables and lines of an answer that fits on one screen, for `print_parts`.

    `report` is the data of report.json. The answer has the outcome, the verdicts on the targets, the springs, the first
    reasons and notes, and the files in `folder`.
    """
    verdicts = _verdicts(report)
    table = verdict_table("", [verdict for verdict in verdicts if not is_on_the_part(verdict)])
    part_outcomes = [verdict.passed for verdict in verdicts if is_on_the_part(verdict)]
    if part_outcomes:
        passed = f"{part_outcomes.count(True)} passed"
        table.add_row(f"{len(part_outcomes)} on geometry and print", "", "", "", passed)
    yield _headline(report, verdicts)
    yield table
    yield from _spring_lines(report)
    problems = not_passed(verdicts)
    yield from reason_lines(problems[:_REASONS], in_table=lambda verdict: not is_on_the_part(verdict))
    if len(problems) > _REASONS:
        yield f"and {len(problems) - _REASONS} more: --verbose lists them all"
    notes = report["notes"]
    # Each line on a verdict, including the line that counts further ones, replaces a note. The answer then fits on one
    # screen.
    verdict_lines = min(len(problems), _REASONS + 1)
    for note in notes[: _NOTES - verdict_lines]:
        yield f"- {escape(note)}"
    out = escape(str(folder))
    yield f"files in {out}: response.csv is the table P -> E, report.json has every number"
    yield f"look at it: open {escape(str(folder / 'report.html'))} in a browser, or pipeline view {out}"
    yield f"all verdicts, errors and {len(notes)} notes: --verbose"


def every_section(report: Json) -> Iterator[RenderableType]:
    """Yield the tables and lines of the whole answer, which --verbose shows, for `print_parts`.

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
    for line in (*report["notes"], *_method_lines(report), *_scatter_lines(report), _cost_line(report)):
        yield escape(line)


def _verdicts(data: Json) -> list[Verdict]:
    """Return the verdicts in a report, or in its part on the paper's springs."""
    return [Verdict(**entry) for entry in data["verdicts"]]


def _headline(report: Json, verdicts: list[Verdict]) -> str:
    """Return the first line: the outcome, the name of the design, and the numbers of failed and undecided verdicts."""
    outcomes = [verdict.passed for verdict in verdicts]
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
        leaf = spring["dimensions_mm"]
        if leaf is None:
            yield f"{name} spring: {spring['target_N_per_m']:.6g} N/m, not made"
            continue
        K = spring["stiffness_N_per_m"]
        stiffness = f"{value_with_bar(K, 0.01 * spring['error_percent'] * K, 'N/m')} by FE"
        size = f"{leaf['length']:g} x {leaf['thickness']:g} x {leaf['depth']:g} mm"
        strain = spring["root_strain"]
        # the safety factor is the strain limit divided by the strain
        limit = "" if spring["safety_factor"] is None else f", limit {spring['safety_factor'] * strain:.2g}"
        leaf_text = f"leaves {size} in {process}, strain {strain:.2g} at full travel{limit}"
        yield escape(f"{name} spring: {stiffness}, {leaf_text}")


def _error_table(report: Json) -> Table:
    """Return a table of the errors [%] of each number, due to the mesh, the model and the print.

    The last column names the two largest causes. Verdicts use only the error due to the mesh. Calibration of a print
    removes most of its scatter.
    """
    columns = ("error of, at 95 %", "mesh ± %", "left out of the model %", "scatter of the print ± %", "largest shares")
    table = Table(*columns)
    for name, budget in report["errors"].items():
        if budget is None:
            continue
        causes = [*budget["model"], *budget["inputs"]]
        causes.sort(key=lambda cause: abs(cause["size_percent"]), reverse=True)
        largest = [f"{cause['effect']} {cause['size_percent']:+.2g}" for cause in causes[:2]]
        totals = (budget[f"{column}_percent"] for column in ("discretisation", "model", "inputs"))
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
    """Yield a line with the scatter of prints before calibration, and a line with the error of E after calibration.

    Only reports written by `pipeline design` have this scatter.
    """
    scatter = report.get("tolerance")
    if scatter is None:
        return
    bands = []
    # A band is a list of its two ends. The other values of `tolerance` are single numbers.
    for name, band in scatter.items():
        if isinstance(band, list):
            low, high = ("no limit" if end is None else f"{end:.4g}" for end in band)
            bands.append(f"{name} {low} to {high}")
    yield f"before calibration 95 % of prints have: {', '.join(bands)}"
    error = scatter["calibrated_modulus_error"]
    accuracy_text = "not known" if error is None else f"known to {100.0 * error:.1f} %"
    yield f"with both stiffnesses of a unit known to 1 %, the modulus that it reads is {accuracy_text}"


def _cost_line(report: Json) -> str:
    """Return a line with the wall-clock and CPU time of each stage [s]."""
    cpu = report["cpu_seconds"]
    stages = [f"{name} {wall:.2f}/{cpu[name]:.2f}" for name, wall in report["seconds"].items()]
    return f"seconds (wall-clock/CPU): {', '.join(stages)}"
