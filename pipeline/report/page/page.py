"""Make report.html, a self-contained page of a report that needs no other file, no network and no font."""

from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path

from pipeline.report.explain.entries import entries
from pipeline.report.page import page_answer as answer
from pipeline.report.page.page_bodies import assembly_body, flexure_body, loaded_half
from pipeline.report.page.page_template import BODIES, FIGURES, load_templates, pack_bytes, render_page
from pipeline.report.page.tables import page_tables
from pipeline.report.report import Report, report_data
from pipeline.result import SensorResult
from pipeline.storage.plain import Plain
from pipeline.storage.record_data import as_data
from pipeline.verdicts.in_words import failed_or_undecided, in_display_units, is_on_the_part, overall_sentence
from sensor.quantity import COVERAGE
from sensor.verdict import Verdict, all_passed
from solve.linear import SolveError

TEMPLATE = "page.html.j2"
TAKEN_FROM = ("base.html.j2", "words.html.j2")  # templates that the template of the page includes

_SPEED = 50.0  # default speed of a filament printer [mm/s]; the reader can enter a different one
_LIMITING_NOTES = 2  # number of notes beside the answer of a design that passes
_USUAL_SLIDERS = ("E", "travel")  # the sliders for tilt and noise are hidden at first
_AT_SLIDERS = ("reading.bias", "bruise")  # the verdicts that the section of the sliders judges at other settings
_FIRST_NUMBERS = 3  # number of verdicts whose values are at the top of the page; failed verdicts come first


def prepare_page(result: SensorResult) -> None:
    """Do the slow work for the page before its files exist: compile the templates, and solve the springs under load.

    The results are cached. Errors are ignored here, because `make_page` meets them again and the page then states them.
    """
    load_templates(TEMPLATE, *TAKEN_FROM)
    with suppress(ValueError, SolveError):
        loaded_half(result.springs, result.options)


def make_page(report: Report, result: SensorResult, folder: Path) -> str:
    """Return the HTML text of report.html: the answer, the verdicts, the notes, plots, 3-D bodies and files of a run.

    The bodies come from `result` and from the files of the output `folder`. For a body that cannot be drawn, the page
    states the reason. Raises OSError if a file that the report lists cannot be read.
    """
    file_names = {file.path for file in report.files}
    bodies, missing = _draw_bodies(report, result, folder)
    # Sorted without the file extension, so that NAME.svg comes before NAME-2.svg; a hyphen sorts before a dot.
    names_by_stem = sorted(file_names, key=lambda name: Path(name).stem)
    drawings = [folder / name for name in names_by_stem if name.endswith(".svg")]
    # An entry explains one verdict, or several verdicts whose names are in `each`.
    meanings = {name: entry.meaning for entry in entries() for name in entry.each or (entry.name,)}
    bill = answer.bill(folder) if answer.BILL in file_names else []
    verdicts = [in_display_units(verdict) for verdict in report.verdicts]
    return render_page(
        TEMPLATE,
        (*FIGURES, *BODIES, "tables.js", "page.js"),
        _script_data(report, result, verdicts, bodies, drawings),
        latest=result.options.look,  # an open page then reloads itself after the next run
        report=report,
        command=result.options.command,
        has_housing=report.design.tips.tip_layout.has_housing,
        short_value=answer.short_value,  # function that the template calls for each verdict
        missing=missing,  # the reason for each body that cannot be drawn
        dimensions=answer.dimensions(report),
        bill=bill,
        printed_g=answer.printed_g(bill),
        speed=_SPEED,
        sizes={file.path: (folder / file.path).stat().st_size for file in report.files},  # [bytes]
        meanings=meanings,
        **_verdict_values(report, verdicts),
    )


def _verdict_values(report: Report, verdicts: list[Verdict]) -> dict[str, object]:
    """Return the variables of the template for the answer, the verdicts and the notes.

    `verdicts` are the verdicts of the report in display units.
    """
    problems = failed_or_undecided(verdicts)  # failed verdicts first, then undecided ones
    # The script of the page finds a verdict by its index in the report, so each verdict is paired with its index.
    on_the_part = [(i, verdict) for i, verdict in enumerate(verdicts) if is_on_the_part(verdict)]
    targets = [(i, verdict) for i, verdict in enumerate(verdicts) if not is_on_the_part(verdict)]
    passed_targets = [verdict for _, verdict in targets if verdict.passed]
    paper_verdicts = () if report.paper is None else report.paper.verdicts
    # The place beside the answer shows the problems, or the first notes if all verdicts passed.
    limiting_notes = [] if problems else report.notes[:_LIMITING_NOTES]
    return {
        "passed": all_passed(verdicts),
        "headline": overall_sentence(report.design.name, verdicts),
        "not_passed": problems,
        "fails_at_sliders": any(verdict.passed is False and verdict.name in _AT_SLIDERS for verdict in problems),
        "numbers": [*problems, *passed_targets][:_FIRST_NUMBERS],  # the verdicts whose values are at the top
        "limiting_notes": limiting_notes,
        "other_notes": report.notes[len(limiting_notes) :],
        "closest": answer.closest_to_limit(verdict for _, verdict in targets),
        "targets": targets,
        "part": on_the_part,
        "paper": {verdict.name: in_display_units(verdict) for verdict in paper_verdicts},  # on the paper's springs
    }


def _script_data(
    report: Report, result: SensorResult, verdicts: list[Verdict], bodies: list[Plain], drawings: list[Path]
) -> Plain:
    """Return the data that the scripts of the page read.

    `verdicts` are the verdicts of the report in display units. `bodies` are the 3-D bodies as page data, and `drawings`
    are the paths of SVG files, whose contents are included in the page.
    """
    return {
        "report": report_data(report),
        "coverage": COVERAGE,  # the half width of a 95 % interval divided by the standard uncertainty
        "usual_sliders": _USUAL_SLIDERS,
        # The sense of a limit, such as "at most", is not a key of report.json, so it is added here.
        "verdicts": [as_data(verdict) | {"sense": verdict.limit_sense} for verdict in verdicts],
        **page_tables(report, result),
        "bodies": bodies,
        "drawings": [{"name": path.name, "content": pack_bytes(path.read_bytes())} for path in drawings],
    }


def _draw_bodies(report: Report, result: SensorResult, folder: Path) -> tuple[list[Plain], dict[str, str]]:
    """Return the 3-D bodies as page data, and the reason for each body that cannot be drawn, keyed by its name.

    No error is raised for a missing body, because the page states the reason instead. A layout without a housing has no
    bodies.
    """
    draw_functions: dict[str, Callable[[], Plain]] = {}
    if report.design.tips.tip_layout.has_housing:
        draw_functions["springs under load"] = partial(flexure_body, report, result)
        draw_functions["assembly"] = partial(assembly_body, folder)
    bodies = []
    missing = {}
    for name, draw in draw_functions.items():
        try:
            bodies.append(draw())
        except (ArithmeticError, ValueError, SolveError) as error:
            missing[name] = str(error)
    return bodies, missing
