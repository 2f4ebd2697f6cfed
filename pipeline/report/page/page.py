"""report.html: one page of a report that needs no other file, no network and no font from elsewhere."""

from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path

from pipeline.report.explain.entries import entries
from pipeline.report.page import answer
from pipeline.report.page.bodies import assembly_body, flexure_body, loaded_half
from pipeline.report.page.tables import page_tables
from pipeline.report.page.template import BODIES, FIGURES, load_templates, pack_bytes, render_page
from pipeline.report.report import Report, report_data
from pipeline.report.verdict_rule import as_read
from pipeline.result import SensorResult
from pipeline.storage.plain import Plain
from pipeline.storage.told import as_data
from sensor.quantity import COVERAGE
from solve.linear import SolveError

TEMPLATE = "page.html.j2"
TAKEN_FROM = ("base.html.j2", "words.html.j2")  # by the template of the page

_SPEED = 50.0  # mm/s of a filament printer, until the reader types another rate
_FIRST_NUMBERS = 3  # that stand at the head of the page, those that did not pass first


def prepare_page(result: SensorResult) -> None:
    """Do what takes longest of a page ahead of its files: compile its templates, solve the springs under load.

    Of what cannot be solved the page tells itself.
    """
    load_templates(TEMPLATE, *TAKEN_FROM)
    with suppress(ValueError, SolveError):
        loaded_half(result.springs, result.options)


def page_of(report: Report, result: SensorResult, folder: Path) -> str:
    """Return the page of a report, with the bodies of a result and of the folder of its files.

    What cannot be drawn is left out, and the page says why.
    """
    own = {file.path for file in report.files}
    bodies, missing = _bodies(report, result, folder)
    drawings = [folder / name for name in sorted(own, key=lambda name: Path(name).stem) if name.endswith(".svg")]
    bill = answer.bill(folder) if answer.BILL in own else []
    verdicts = [as_read(verdict) for verdict in report.verdicts]
    # A verdict keeps the number by which the page finds it in its data.
    on_the_part = [(i, one) for i, one in enumerate(verdicts) if answer.is_on_the_part(one)]
    targets = [(i, one) for i, one in enumerate(verdicts) if not answer.is_on_the_part(one)]
    first_answer = answer.answer_of(report)
    not_passed = [as_read(verdict) for verdict in first_answer.not_passed]
    paper = [] if report.paper is None else [as_read(verdict) for verdict in report.paper.verdicts]
    page_data = {
        "report": report_data(report),
        "coverage": COVERAGE,
        "verdicts": [as_data(verdict) | {"sense": verdict.limit_sense} for verdict in verdicts],
        **page_tables(report, result),
        "bodies": bodies,
        "drawings": [{"name": path.name, "content": pack_bytes(path.read_bytes())} for path in drawings],
    }
    return render_page(
        TEMPLATE,
        (*FIGURES, *BODIES, "tables.js", "page.js"),
        page_data,
        latest=result.options.look,
        report=report,
        command=result.options.command,
        answer=first_answer,
        has_housing=report.design.tips.tip_layout.has_housing,
        not_passed=not_passed,
        numbers=[*not_passed, *(one for _, one in targets if one.passed)][:_FIRST_NUMBERS],
        closest=answer.closest_to_limit(one for _, one in targets),
        targets=targets,
        part=on_the_part,
        paper={verdict.name: verdict for verdict in paper},
        missing=missing,
        dimensions=answer.dimensions(report),
        bill=bill,
        printed_g=answer.printed_g(bill),
        speed=_SPEED,
        sizes={file.path: (folder / file.path).stat().st_size for file in report.files},
        meanings={name: entry.meaning for entry in entries() for name in entry.each or (entry.name,)},
    )


def _bodies(report: Report, result: SensorResult, folder: Path) -> tuple[list[Plain], dict[str, str]]:
    """Return the bodies that the page shows, and by name why each other one cannot be drawn."""
    draws: dict[str, Callable[[], Plain]] = {}
    if report.design.tips.tip_layout.has_housing:
        draws["springs under load"] = partial(flexure_body, report, result)
        draws["assembly"] = partial(assembly_body, folder)
    bodies = []
    missing = {}
    for name, draw in draws.items():
        try:
            bodies.append(draw())
        except (ArithmeticError, ValueError, SolveError) as error:
            missing[name] = str(error)
    return bodies, missing
