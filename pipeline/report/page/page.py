"""report.html: one page of a report that needs no other file, no network and no font from elsewhere."""

import math
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path

import numpy as np

from pipeline.report.explain.entries import entries
from pipeline.report.page import answer
from pipeline.report.page.bodies import assembly_body, flexure_body, loaded_half, skin_body
from pipeline.report.page.mangoes import alike_pairs, seen_mangoes
from pipeline.report.page.tables import page_tables
from pipeline.report.page.template import BODIES, FIGURES, load_templates, pack_bytes, render_page
from pipeline.report.report import Report, as_data, report_data
from pipeline.report.verdict_rule import (
    ERRORS_IN_WORDS,
    UNREAD,
    as_read,
    fails_unread,
    limit_text,
    measured,
    tolerance_text,
)
from pipeline.response.scene_press import scene_of
from pipeline.result import SensorResult
from pipeline.storage.plain import Plain
from sensor.arrays import Floats
from sensor.design.tips import Tips
from sensor.quantity import COVERAGE
from solve.contact.pressure import footprint_pressure
from solve.halfspace.punch import graded_edges, influence
from solve.linear import SolveError

TEMPLATE = "page.html.j2"
TAKEN_FROM = ("base.html.j2", "words.html.j2")  # by the template of the page

_SPEED = 50.0  # mm/s of a filament printer, until the reader types another rate
_POINTS = 121  # along the contact of a dome
_CELLS = 17  # along each side of a flat tip, one of them in the middle
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
    mangoes = seen_mangoes(report)
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
        "profile": _pressure_profile(report, result),
        "mangoes": [seen.mango._asdict() | {"P": seen.P} for seen in mangoes],
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
        scene=answer.scene_in_words(report.design),
        targets=targets,
        part=on_the_part,
        paper={verdict.name: verdict for verdict in paper},
        missing=missing,
        mangoes=mangoes,
        resolved={
            "as printed": alike_pairs([seen.printed for seen in mangoes]),
            "after calibrating the unit": alike_pairs([seen.calibrated for seen in mangoes]),
        },
        dimensions=answer.dimensions(report),
        bill=bill,
        printed_g=answer.printed_g(bill),
        speed=_SPEED,
        sizes={file.path: (folder / file.path).stat().st_size for file in report.files},
        outcomes=answer.OUTCOMES,
        errors_in_words=ERRORS_IN_WORDS,
        measured=measured,
        limit_text=limit_text,
        tolerance_text=tolerance_text,
        meanings={name: entry.meaning for entry in entries() for name in entry.each or (entry.name,)},
        unread=UNREAD,
        fails_unread=fails_unread,
    )


def _bodies(report: Report, result: SensorResult, folder: Path) -> tuple[list[Plain], dict[str, str]]:
    """Return the bodies that the page shows, and by name why each other one cannot be drawn."""
    scene = scene_of(report.design, result.press.height_offsets)
    draws: dict[str, Callable[[], Plain]] = {}
    if report.design.tips.tip_layout.has_housing:
        draws["springs under load"] = partial(flexure_body, report, result)
        draws["assembly"] = partial(assembly_body, folder)
    draws["skin under the tips"] = partial(skin_body, report, scene)
    bodies = []
    missing = {}
    for name, draw in draws.items():
        try:
            bodies.append(draw())
        except (ArithmeticError, ValueError, SolveError) as error:
            missing[name] = str(error)
    return bodies, missing


def _pressure_profile(report: Report, result: SensorResult) -> Plain:
    """Return pressure over its mean [1] along the middle of one tip of each spring; else a reason.

    Positions are over the root of the area [1] that the mean is of: the contact of a dome, the face of another tip.
    Domes press as Hertz's sphere, level flat tips on flat fruit as one on a half-space, others as their cells of
    contact were solved.
    """
    design = result.design
    scene = scene_of(design, result.press.height_offsets)
    if design.tips.dome_radius_mm is not None or scene.linear:
        positions, over_mean = dome_pressure() if design.tips.dome_radius_mm is not None else flat_pressure(design.tips)
        profile = {"x": positions.tolist(), "over_mean": over_mean.tolist()}
        return {"low": profile, "high": profile}
    E = float(result.press.at_largest_E.E[-1])
    try:
        contact = footprint_pressure(scene, result.contact.at(E), result.springs.C, E, design.press.travel_mm)
    except (ArithmeticError, ValueError, SolveError) as error:
        return {"reason": str(error)}
    sizes = np.diff(contact.edges)
    centres = 0.5 * (contact.edges[1:] + contact.edges[:-1])
    middle = len(sizes) // 2
    face = design.tips.face_mm2
    profiles = {}
    for spring in ("low", "high"):
        tip = next(index for index, tip in enumerate(report.tips) if tip.spring == spring)
        force = float(contact.cell_forces[tip].sum())
        if not force > 0.0:
            return {"reason": "a tip is off the fruit"}
        pressure = contact.cell_forces[tip, :, middle] / (sizes * sizes[middle])
        over_mean = pressure * face / force
        profiles[spring] = {"x": (centres / math.sqrt(face)).tolist(), "over_mean": over_mean.tolist()}
    return profiles


def dome_pressure() -> tuple[Floats, Floats]:
    """Return positions along the middle of Hertz's contact over the root of its area, and the pressure over its mean.

    The pressure is 3/2 of the mean times sqrt(1 - r^2 / a^2), K. L. Johnson, Contact Mechanics, (3.39) [both 1].
    """
    over_radius = np.linspace(-1.0, 1.0, _POINTS)
    return over_radius / math.sqrt(math.pi), 1.5 * np.sqrt(1.0 - over_radius**2)


def flat_pressure(tips: Tips) -> tuple[Floats, Floats]:
    """Return positions along the middle of a flat tip over the root of its face, and the pressure over its mean [1].

    Under a round tip it is 1 / (2 sqrt(1 - r^2 / a^2)), K. L. Johnson, Contact Mechanics, (3.34). Under a square one it
    is uniform on each of graded cells that go down by the same depth.
    """
    edges = graded_edges(_CELLS)
    along = 0.5 * (edges[1:] + edges[:-1])
    over_root = tips.side_mm / math.sqrt(tips.face_mm2) * along
    if tips.tip_shape.is_round:
        return over_root, 0.5 / np.sqrt(1.0 - (2.0 * along) ** 2)
    areas = np.outer(np.diff(edges), np.diff(edges)).ravel()
    # The sinking of each cell times its area, by unit pressure on each cell: one matrix over all cells.
    sinking = influence(edges, edges).transpose(0, 2, 1, 3).reshape(len(areas), len(areas))
    pressure = np.linalg.solve(sinking, areas)
    over_mean = pressure / (pressure @ areas)
    return over_root, over_mean.reshape(_CELLS, _CELLS)[_CELLS // 2]
