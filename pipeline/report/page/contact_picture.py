"""The contact of two tips in section: pressure above, tip and skin below."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from cad.theory import hertz
from pipeline.report.page.drawing.panel import DASHED, DOTTED, INK, MUTED, SERIES, Box, Panel, Words
from pipeline.report.page.drawing.picture import Picture, plot_picture
from pipeline.report.page.drawing.scale import Scale
from pipeline.report.page.fields import Fields, Floats, TipPressure
from pipeline.report.stored import StoredReport

_SHEET = 475.0  # [pt] wide: pictures of fields
_REACH = 1.9  # half width of a section, in half widths of what touches
_QUARTER = math.pi / 2.0
_BY_HERTZ = "Pressure of domes by Hertz."
_NO_BOUND = "Under the edge of a flat tip the pressure has no bound: the plot ends at three times the mean."
_LEAST_HEIGHT = 330.0  # [pt] of the sheet
_UNDER_SECTION = 38.0  # [pt] for the numbers and the name of the scale below
_CUT = 3.0  # mean pressures at which a plot ends: under an edge there is no bound


def contact_picture(report: StoredReport, fields: Fields) -> Picture | None:
    """Return pressure [MPa] and section of one tip of each kind at E_max and full travel; None where not known."""
    row = max(report.response, key=lambda one: one.E_MPa)
    first = {tip.spring: place for place, tip in reversed(list(enumerate(report.tips)))}
    forces = {place: row.tip_forces[place][-1] or 0.0 for place in sorted(first.values())}
    touches = {report.tips[place].spring: _touch(report, fields, row.E_MPa, forces, place) for place in forces}
    drawn = [(kind, touch) for kind, touch in touches.items() if touch is not None]
    if len(drawn) < len(touches):
        return None
    panels, caption = _sections(drawn), _caption(report, row.E_MPa, drawn)
    foot = max(panel.box.top + panel.box.height for panel in panels)
    size = (_SHEET, max(_LEAST_HEIGHT, foot + _UNDER_SECTION))
    words = (caption, f"Two tips in the skin. {caption}")
    return plot_picture(panels, "contact", "Pressure where the tips touch", words, size)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Touch:
    """One tip on the fruit: its pressure and their mean [MPa], outlines of tip, skin, and skin at rest [mm]."""

    pressure: TipPressure
    tip: Floats
    skin: Floats
    rest: Floats
    mean: float


def _domed(report: StoredReport) -> bool:
    return report.design.tips.dome_radius_mm is not None


def _caption(report: StoredReport, E: float, drawn: Sequence[tuple[str, _Touch]]) -> str:
    """Return what is drawn for each kind of tip, at modulus E [MPa], in words."""
    peaks = ", ".join(f"{kind} tip {touch.mean:.3g} MPa in the mean" for kind, touch in drawn)
    return (
        f"On a fruit of {E:g} MPa at full travel, in a section through the tips: {peaks}. Above the pressure "
        f"along the section, below tip and skin in their true proportions{_simplified(report)}, the dotted line the "
        f"skin before the press. {_BY_HERTZ if _domed(report) else _NO_BOUND}"
    )


def _simplified(report: StoredReport) -> str:
    """Return in words how flat tips are drawn where that is not how they press; nothing where it is, and for domes."""
    press = report.design.press
    if _domed(report):
        return ""
    level = ["level"] if press.tilt_deg != 0.0 or press.roll_deg != 0.0 else []
    linear = ["as deep as by the linear law"] if press.strain == "large" else []
    return f" (drawn {' and '.join(level + linear)})" if level or linear else ""


def _touch(report: StoredReport, fields: Fields, E: float, forces: Mapping[int, float], place: int) -> _Touch | None:
    """Return one tip on the fruit, by its place among the tips; `forces` are those of the tips that are drawn [N]."""
    if min(forces.values()) <= 0.0:
        return None
    if _domed(report):
        reach = _REACH * max(contact_radius(report, E, force) for force in forces.values())
        return _dome_touch(report, E, forces[place], reach)
    if place >= len(fields.pressures):
        return None
    depth = report.contact.compliance_per_mm[place][place] * forces[place] / E
    return _flat_touch(report, fields.pressures[place], place, (forces[place], depth))


def _flat_touch(report: StoredReport, pressure: TipPressure, place: int, pressed: tuple[float, float]) -> _Touch:
    """Return the flat tip of a place under a force [N], pressed in by a depth [mm].

    The skin beside it is that beside a circle: 2 depth / pi asin(half / r), K. L. Johnson, Contact Mechanics, (3.38).
    """
    (force, depth), half = pressed, 0.5 * report.design.tips.side_mm
    x = np.linspace(-_REACH * half, _REACH * half, 121)
    rest = _rest(report, place, x)
    beside = rest - depth * np.arcsin(half / np.maximum(np.abs(x), half)) / _QUARTER
    skin = np.where(np.abs(x) <= half, np.minimum(rest, -depth), beside)
    box = np.array([[-half, 2.0 * half], [-half, -depth], [half, -depth], [half, 2.0 * half]])
    mean = force / report.design.tips.face_mm2
    return _Touch(pressure=pressure, tip=box, skin=_line(x, skin), rest=_line(x, rest), mean=mean)


def _rest(report: StoredReport, place: int, x: Floats) -> Floats:
    """Return the skin before the press [mm] at places x [mm] along the tips from the middle of a tip, 0 there."""
    tip, fruit = report.tips[place], report.design.fruit
    falls = [fruit.fall_mm(tip.x_mm + away, tip.y_mm) for away in x.tolist()]
    return np.asarray(fruit.fall_mm(tip.x_mm, tip.y_mm) - np.array(falls))


def _dome_touch(report: StoredReport, E: float, force: float, reach: float) -> _Touch:
    """Return a dome by Hertz: K. L. Johnson, Contact Mechanics, (3.42a) and (4.22) to (4.24)."""
    radius, x = contact_radius(report, E, force), np.linspace(-reach, reach, 241)
    bent, along = 1.0 / (report.design.tips.dome_radius_mm or math.inf), 1.0 / report.design.fruit.radii_mm[0]
    depth, mean = radius**2 * (bent + along), force / (math.pi * radius**2)
    cap, rest = 0.5 * bent * x**2 - depth, -0.5 * along * x**2
    skin = np.where(np.abs(x) <= radius, cap, rest - depth * _beside(np.abs(x) / radius))
    pressure = TipPressure(places=x, pressure=1.5 * mean * _ellipse(x / radius))
    return _Touch(pressure=pressure, tip=_line(x, cap), skin=_line(x, skin), rest=_line(x, rest), mean=mean)


def _ellipse(r: Floats) -> Floats:
    return np.asarray(np.sqrt(np.maximum(0.0, 1.0 - r**2)))


def _beside(r: Floats) -> Floats:
    """Return how deep the skin is at r radii from the middle of Hertz's pressure, in depths of the tip [1]."""
    r = np.maximum(r, 1.0)
    return np.asarray(((2.0 - r**2) * np.arcsin(1.0 / r) + np.sqrt(r**2 - 1.0)) / math.pi)


def _line(x: Floats, z: Floats) -> Floats:
    return np.stack([x, z], axis=1)


def contact_radius(report: StoredReport, E: float, force: float) -> float:
    """Return the radius that a dome touches with [mm] at modulus E [MPa] and a force [N]; Hertz."""
    fruit, dome = report.design.fruit, report.design.tips.dome_radius_mm or math.inf
    return hertz.contact_radius(force, E, fruit.poisson, hertz.mean_relative_curvature(dome, *fruit.radii_mm))


def _sections(drawn: Sequence[tuple[str, _Touch]]) -> list[Panel]:
    """Return panels with pressure above and section below for each kind of tip, side by side on common scales."""
    touches = [touch for _, touch in drawn]
    reach, column = _widest(touches), (_SHEET - 55.0) / len(drawn)
    x, y, height = Scale(start=-reach, end=reach, steps=5), _pressure_scale(touches), _height_scale(touches, reach)
    panels = []
    for place, (kind, touch) in enumerate(drawn):
        box = Box(left=55.0 + place * column, top=22.0, width=column - 24.0, height=125.0)
        label = "pressure [MPa]" if place == 0 else None
        upper = Panel(name=f"pressure-{kind}", box=box, x=x, y=y, y_label=label)
        _draw_pressure(upper, touch, SERIES[place])
        upper.write_at(f"tip on the {kind} spring", box.left + 0.5 * box.width, 10.0, Words(anchor="middle"))
        panels += [upper, _section(upper, touch, height, named=place == 0)]
    return panels


def _widest(touches: Sequence[_Touch]) -> float:
    """Return how far from the middle of a tip the widest section reaches [mm]."""
    return max(float(touch.skin[-1, 0]) for touch in touches)


def _pressure_scale(touches: Sequence[_Touch]) -> Scale:
    """Return the scale that shows all pressures [MPa] as far as a plot shows them."""
    most = max(min(1.08 * float(touch.pressure.pressure.max()), _CUT * touch.mean) for touch in touches)
    return Scale(start=0.0, end=most, steps=5)


def _height_scale(touches: Sequence[_Touch], reach: float) -> Scale:
    """Return the scale of heights [mm] that shows the deepest tip with a margin."""
    deepest = min(float(touch.tip[:, 1].min()) for touch in touches)
    return Scale(start=min(-0.6 * reach, deepest - 0.1 * reach), end=0.3 * reach, steps=5)


def _draw_pressure(panel: Panel, touch: _Touch, colour: str) -> None:
    x, pressure = touch.pressure.places, touch.pressure.pressure
    panel.area((x, np.zeros_like(x)), (x, pressure), colour, 0.35)
    panel.line(x, pressure, colour)
    panel.level(touch.mean, INK, 0.9, DASHED)
    panel.write("mean", panel.x.end, touch.mean, Words(anchor="end", right=-2.0, down=-7.0, size=8.5))


def _section(upper: Panel, touch: _Touch, y: Scale, *, named: bool) -> Panel:
    """Return the panel of tip and skin below that of the pressure, in true proportions; `named` with its heights."""
    width, size = upper.box.width, (y.end - y.start) / (upper.x.end - upper.x.start)
    below = Panel(
        name=upper.name.replace("pressure", "section"),
        box=Box(left=upper.box.left, top=185.0, width=width, height=size * width),
        x=upper.x,
        y=y,
        x_label="from the tip's middle [mm]",
        y_label="height [mm]" if named else None,
    )
    (tip_x, tip_z), (x, z), (rest_x, rest_z) = touch.tip.T, touch.skin.T, touch.rest.T
    below.area((tip_x, tip_z), (tip_x, np.full_like(tip_z, y.end)), MUTED, 0.4)
    below.area((x, z), (x, np.full_like(z, y.start)), SERIES[3], 0.35)
    below.line(tip_x, tip_z, INK, 1.0)
    below.line(x, z, INK, 1.0)
    below.line(rest_x, rest_z, INK, 0.9, DOTTED)
    return below
