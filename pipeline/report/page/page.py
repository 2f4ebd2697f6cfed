"""report.html: one page of a report that needs no other file, no network and no font from elsewhere."""

from collections.abc import Iterable
from concurrent.futures import Executor, Future
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from cad.design.parameters import Design
from cad.parts.housing import Housing
from pipeline.report.cad_tasks import draw_pictures
from pipeline.report.outputs import Page
from pipeline.report.page.answer import answer_of, dimension_rows, limit_of, shown, verdict_rows
from pipeline.report.page.contact_picture import contact_picture
from pipeline.report.page.drawing.picture import Picture
from pipeline.report.page.error_plots import budget_plot, pose_plot, speed_plot
from pipeline.report.page.fields import Fields, fields_of_folder, fields_of_result
from pipeline.report.page.flexure_picture import flexure_picture
from pipeline.report.page.live_model import LiveModel, live_data, live_model
from pipeline.report.page.mangoes import SeenMango, seen_mangoes, told_apart
from pipeline.report.page.response_plots import modulus_plot, pressure_plot, travel_plot
from pipeline.report.page.solid_pictures import SolidPictures
from pipeline.report.stored import StoredReport
from pipeline.result import SensorResult
from pipeline.storage.cache import stored
from pipeline.storage.plain import Plain
from pipeline.storage.workers import finished, submit

_HERE = Path(__file__).parent
_TEMPLATE = "page.html.j2"
_WITH_FIELDS = "run the design again with --fields"


def begin_pictures(
    design: Design, housing: Housing | None, folder: Path, executor: Executor | None
) -> Future[SolidPictures]:
    """Let the part be drawn whose STL file a worker writes before; pictures of an earlier run are there at once."""
    if housing is None:
        return finished(SolidPictures())
    inputs = {"fruit": design.fruit, "tips": design.tips, "press": design.press, "housing": housing}
    kept = stored("pictures", inputs, SolidPictures)
    if kept is not None:
        return finished(kept)
    return submit(executor, draw_pictures, inputs, design, housing, folder)


def page_of_run(result: SensorResult, solids: SolidPictures) -> Page:
    """Return what makes the page of a run, with fields of the run that its folder does not hold."""

    def made(report: StoredReport, folder: Path) -> str:
        return _page(report, solids, fields_of_result(result, report, folder))

    return made


def page_of_folder(report: StoredReport, folder: Path, solids: SolidPictures) -> str:
    """Return the page of a finished output folder; what its files do not hold is left out, and the page says so."""
    return _page(report, solids, fields_of_folder(report, folder))


def _page(report: StoredReport, solids: SolidPictures, fields: Fields) -> str:
    model, mangoes = live_model(report), seen_mangoes(report)
    targets, part = verdict_rows(report)
    pictures, no_pictures = _present(_pictures(report, solids, fields))
    plots, no_plots = _present(_plots(report, model, mangoes))
    environment = Environment(
        loader=FileSystemLoader(_HERE),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(_TEMPLATE).render(
        report=report,
        answer=answer_of(report),
        targets=targets,
        part=part,
        pictures=pictures,
        plots=plots,
        missing=(*no_pictures, *no_plots),
        live=live_data(report, model),
        mangoes=mangoes,
        told=_told(mangoes),
        dimensions=tuple(dimension_rows(report)),
        shown=shown,
        limit_of=limit_of,
        style=_own("page.css"),
        script=_own("live.js"),
    )


def _own(name: str) -> str:
    """Return a file of this room as it stands."""
    return (_HERE / name).read_text(encoding="utf-8")


def _present(every: Iterable[tuple[Picture | None, str]]) -> tuple[tuple[Picture, ...], tuple[str, ...]]:
    """Return the pictures that there are, and of each other one why it is left out."""
    pairs = tuple(every)
    return tuple(one for one, _ in pairs if one is not None), tuple(why for one, why in pairs if one is None)


def _pictures(report: StoredReport, solids: SolidPictures, fields: Fields) -> Iterable[tuple[Picture | None, str]]:
    no_part = "no part is made"
    yield solids.part, f"picture of the part: {no_part}"
    yield solids.assembly, f"picture of the assembly: {no_part}"
    no_stress = "no part is made" if report.housing is None else f"the folder holds no stress: {_WITH_FIELDS}"
    yield flexure_picture(report, fields), f"picture of the flexures under load: {no_stress}"
    words = f"a tip is off the fruit, or the folder holds no pressure: {_WITH_FIELDS}"
    yield contact_picture(report, fields), f"picture of the contact: {words}"


def _plots(
    report: StoredReport, model: LiveModel, mangoes: tuple[SeenMango, ...]
) -> Iterable[tuple[Picture | None, str]]:
    off = "a tip is off the fruit at every modulus"
    yield modulus_plot(report, mangoes), f"plot of P over the modulus: {off}"
    yield travel_plot(report), f"plot of P over the travel: {off}"
    tilts = "the scene is not linear and the design has no [reading], so that no tilted press was solved"
    yield pose_plot(report, model), f"plot of the error against tilt: {tilts}"
    yield pressure_plot(report), ""
    yield budget_plot(report), "plot of the error budget: no number has one"
    yield speed_plot(report), "plot of speed against error: nothing was solved"


def _told(mangoes: tuple[SeenMango, ...]) -> Plain:
    """Return which pairs of mangoes can be told apart, by the words for the error bar."""
    bars = {
        "as printed": [(one.mango.number, one.printed) for one in mangoes],
        "after calibrating the unit": [(one.mango.number, one.calibrated) for one in mangoes],
    }
    return {words: told_apart(each) for words, each in bars.items()}
