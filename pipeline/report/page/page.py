"""report.html: one page of a report that needs no other file, no network and no font from elsewhere."""

from collections.abc import Callable, Mapping
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from pipeline.report.explain.entries import entries
from pipeline.report.page import answer
from pipeline.report.page.drawing.picture import Picture
from pipeline.report.page.error_plots import budget_plot, pose_plot, speed_plot
from pipeline.report.page.field_pictures import contact_picture, flexure_picture
from pipeline.report.page.live_model import live_data, live_model
from pipeline.report.page.mangoes import alike_pairs, seen_mangoes
from pipeline.report.page.response_plots import modulus_plot, pressure_plot, travel_plot
from pipeline.report.stored import StoredReport
from pipeline.report.verdict_rule import UNREAD, fails_unread, limit_text, number_text, tolerance_text
from pipeline.result import SensorResult
from solve.linear import SolveError

_HERE = Path(__file__).parent


def page_of(report: StoredReport, result: SensorResult) -> str:
    """Return the page of a report, with fields of the result that it was made of.

    A picture that cannot be drawn is left out, and the page says why.
    """
    model = live_model(report)
    mangoes = seen_mangoes(report)
    draws = {
        "flexures under load": lambda: flexure_picture(report, result),
        "contact": lambda: contact_picture(report, result),
        "P over the modulus": lambda: modulus_plot(report, mangoes),
        "P over the travel": lambda: travel_plot(report),
        "error against tilt": lambda: pose_plot(report, model),
        "pressure on the skin": lambda: pressure_plot(report),
        "error budget": lambda: budget_plot(report),
        "speed against error": lambda: speed_plot(report),
    }
    pictures, missing = _drawn(draws)
    resolved = {
        "as printed": alike_pairs([seen.printed for seen in mangoes]),
        "after calibrating the unit": alike_pairs([seen.calibrated for seen in mangoes]),
    }
    environment = Environment(
        loader=FileSystemLoader(_HERE),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("page.html.j2").render(
        report=report,
        answer=answer.answer_of(report),
        scene=answer.scene_in_words(report.design),
        targets=[verdict for verdict in report.verdicts if not answer.is_on_the_part(verdict)],
        part=[verdict for verdict in report.verdicts if answer.is_on_the_part(verdict)],
        paper={} if report.paper is None else {verdict["name"]: verdict for verdict in report.paper["verdicts"]},
        pictures=pictures,
        missing=missing,
        live=live_data(report, model),
        mangoes=mangoes,
        resolved=resolved,
        dimensions=answer.dimensions(report),
        outcomes=answer.OUTCOMES,
        number_text=number_text,
        limit_text=limit_text,
        tolerance_text=tolerance_text,
        bar_of=answer.bar_of,
        meanings={name: entry.meaning for entry in entries() for name in entry.each or (entry.name,)},
        unread=UNREAD,
        fails_unread=fails_unread,
        style=(_HERE / "page.css").read_text(encoding="utf-8"),
        script=(_HERE / "live.js").read_text(encoding="utf-8"),
    )


def _drawn(draws: Mapping[str, Callable[[], Picture]]) -> tuple[list[Picture], dict[str, str]]:
    """Return the pictures, and why each other one cannot be drawn: its numbers are in report.json all the same."""
    pictures = []
    missing = {}
    for name, draw in draws.items():
        try:
            pictures.append(draw())
        except (ArithmeticError, ValueError, SolveError) as error:
            missing[name] = str(error)
    return pictures, missing
