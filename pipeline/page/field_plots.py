"""Plots of fields: the flexures under full travel with their stress, the contact of two tips in section."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.tri import Triangulation

from cad.theory import hertz
from pipeline.page.fields import Fields, FlexureSection, Floats, Ints, TipPressure
from pipeline.page.picture import INK, MUTED, SERIES, Picture, plot_axes, plot_picture, plot_style
from pipeline.report.stored import StoredReport

_DRAWN = 0.025  # largest deflection as drawn, as a share of the width
_OUTLINE = "#505050"  # on the pale shades of little stress, in light and dark
_SHADES = mpl.colormaps["YlOrRd"]
_CORNERS = ((7, 0, 1), (1, 2, 3), (3, 4, 5), (5, 6, 7), (7, 1, 3), (7, 3, 5))
"""Triangles of a face of eight nodes, corners and middles in turn."""
_REACH = 1.9  # half width of a section, in half widths of what touches
_QUARTER = math.pi / 2.0
_BY_HERTZ = "Pressure of domes by Hertz."
_NO_BOUND = "Under the edge of a flat tip the pressure has no bound: the plot ends at three times the mean."
_CUT = 3.0  # mean pressures at which a plot ends: under an edge there is no bound


def flexure_picture(report: StoredReport, fields: Fields) -> Picture | None:
    """Return the deflected flexures with von Mises stress [MPa] and the limit; None where no stress is known."""
    section = fields.flexure
    if section is None:
        return None
    process = report.design.process
    limit, largest = process.E_MPa * process.strain_limit, float(section.stress.max())
    width, rise = np.ptp(section.places, axis=0).tolist()
    factor = _drawn_factor(float(np.linalg.norm(section.moves, axis=1).max()), width)
    height = 6.2 * rise / width + 1.5  # inches: the picture in proportion, then axis and scale
    axes = plot_axes("x [mm]", "z [mm]", (6.6, height))
    axes.set_position((0.1, 1.35 / height, 0.88, 1.0 - 1.42 / height))
    most = 1.06 * max(limit, largest)
    _draw_flexure(axes, section, factor, most)
    _stress_bar(axes, limit, most)
    caption = (
        f"Middle plane at full travel on the firmest fruit, deflection drawn {factor:g} times; largest von Mises "
        f"stress {largest:.3g} MPa, limit {limit:.3g} MPa (E of {process.name} times its strain limit). "
        f"Safety against the strain limit: {_safety(report)}."
    )
    return plot_picture(axes, "flexure", "Flexures under load", caption, f"Front view of the bent leaves. {caption}")


def _safety(report: StoredReport) -> str:
    known = ((name, spring.safety_factor) for name, spring in report.springs.items())
    return ", ".join(f"{name} spring {factor:.3g}" for name, factor in known if factor is not None) or "not known"


def _draw_flexure(axes: Axes, section: FlexureSection, factor: float, most: float) -> None:
    moved = section.places + factor * section.moves
    triangles = np.concatenate([section.faces[:, list(corner)] for corner in _CORNERS])
    shape = Triangulation(moved[:, 0], moved[:, 1], triangles)
    axes.tripcolor(shape, section.stress, shading="gouraud", cmap=_SHADES, vmin=0.0, vmax=most, rasterized=True)
    outline = _outline(section.faces)
    axes.add_collection(LineCollection(section.places[outline].tolist(), colors=MUTED, linewidths=0.5, linestyles=":"))
    axes.add_collection(LineCollection(moved[outline].tolist(), colors=_OUTLINE, linewidths=0.7))
    axes.set_aspect("equal")
    axes.grid(visible=False)
    axes.autoscale_view()


def _outline(faces: Ints) -> Ints:
    """Return the edges that belong to one face only, as three nodes each, shape (edges, 3)."""
    edges = np.concatenate([faces[:, [start, start + 1, (start + 2) % 8]] for start in (0, 2, 4, 6)])
    _, first, count = np.unique(edges[:, 1], return_index=True, return_counts=True)
    alone: Ints = edges[first[count == 1]]
    return alone


def _stress_bar(axes: Axes, limit: float, most: float) -> None:
    """Draw the scale of stress [MPa] below the picture, with a line at the limit."""
    height = axes.figure.bbox.height / axes.figure.dpi
    with plot_style():
        bar = axes.figure.add_axes((0.2, 0.5 / height, 0.6, 0.14 / height))
    steps = np.linspace(0.0, most, 65)
    bar.pcolormesh(steps, [0.0, 1.0], 0.5 * (steps[1:] + steps[:-1])[None], cmap=_SHADES, rasterized=True)
    bar.axvline(limit, color="black", linewidth=3.0)
    bar.set_yticks([])
    bar.set_xlabel("von Mises stress [MPa]; the line is the limit")


def _drawn_factor(deflection: float, width: float) -> float:
    """Return by how much deflections are drawn larger [1]: 1, 2 or 5 times a power of ten, at least 1."""
    wanted = _DRAWN * width / deflection if deflection > 0.0 else 1.0
    power = 10.0 ** math.floor(math.log10(max(wanted, 1.0)))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= max(wanted, 1.0))


def contact_picture(report: StoredReport, fields: Fields) -> Picture | None:
    """Return pressure [MPa] and section of one tip of each kind at E_max and full travel; None where not known."""
    row = max(report.response, key=lambda one: one.E_MPa)
    first = {tip.spring: place for place, tip in reversed(list(enumerate(report.tips)))}
    forces = {place: row.tip_forces[place][-1] or 0.0 for place in sorted(first.values())}
    touches = {report.tips[place].spring: _touch(report, fields, row.E_MPa, forces, place) for place in forces}
    drawn = [(kind, touch) for kind, touch in touches.items() if touch is not None]
    if len(drawn) < len(touches):
        return None
    axes = plot_axes("", "pressure [MPa]", (6.6, 4.6))
    _draw_sections(axes, drawn)
    peaks = ", ".join(f"{kind} tip {touch.mean:.3g} MPa in the mean" for kind, touch in drawn)
    caption = (
        f"On a fruit of {row.E_MPa:g} MPa at full travel, in a section through the tips: {peaks}. Above the pressure "
        "along the section, below tip and skin in their true proportions, the dotted line the skin before the press. "
        f"{_BY_HERTZ if _domed(report) else _NO_BOUND}"
    )
    return plot_picture(axes, "contact", "Pressure where the tips touch", caption, f"Two tips in the skin. {caption}")


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


def _draw_sections(axes: Axes, drawn: Sequence[tuple[str, _Touch]]) -> None:
    """Draw pressure above and section below for each kind of tip, side by side on common scales."""
    most = max(min(1.08 * float(one.pressure.pressure.max()), _CUT * one.mean) for _, one in drawn)
    reach = max(float(one.skin[-1, 0]) for _, one in drawn)
    axes.set_visible(False)
    for place, (kind, touch) in enumerate(drawn):
        upper, lower = _panels(axes, place, len(drawn))
        _draw_pressure(upper, touch, SERIES[place])
        _draw_section(lower, touch, reach)
        upper.set_ylim(0.0, most)
        upper.set_xlim(-reach, reach)
        upper.set_title(f"tip on the {kind} spring", fontsize=10, color=INK)


def _panels(axes: Axes, place: int, count: int) -> tuple[Axes, Axes]:
    """Return the panels of pressure and of section in one of so many columns; the first one has the scales."""
    width = 0.88 / count
    left = 0.12 + place * width
    with plot_style():
        upper = axes.figure.add_axes((left, 0.55, width - 0.05, 0.38))
        lower = axes.figure.add_axes((left, 0.1, width - 0.05, 0.36))
    for panel, words in ((upper, "pressure [MPa]"), (lower, "height [mm]")):
        panel.set_ylabel(words if place == 0 else "")
        panel.tick_params(labelleft=place == 0)
    return upper, lower


def _draw_pressure(axes: Axes, touch: _Touch, colour: str) -> None:
    line = touch.pressure
    axes.fill_between(line.places, line.pressure, color=colour, alpha=0.35, linewidth=0.0)
    axes.plot(line.places, line.pressure, color=colour)
    axes.axhline(touch.mean, color=INK, linestyle="--", linewidth=0.9)
    place, across = (0.99, touch.mean), ("axes fraction", "data")
    axes.annotate("mean", place, xycoords=across, ha="right", va="bottom", fontsize=8.5, color=INK)


def _draw_section(axes: Axes, touch: _Touch, reach: float) -> None:
    top = np.full(len(touch.tip), reach)
    axes.fill_between(touch.tip[:, 0], touch.tip[:, 1], top, color=MUTED, alpha=0.4, linewidth=0.0)
    axes.fill_between(touch.skin[:, 0], touch.skin[:, 1], -2.0 * reach, color=SERIES[3], alpha=0.35, linewidth=0.0)
    axes.plot(touch.tip[:, 0], touch.tip[:, 1], color=INK, linewidth=1.0)
    axes.plot(touch.skin[:, 0], touch.skin[:, 1], color=INK, linewidth=1.0)
    axes.plot(touch.rest[:, 0], touch.rest[:, 1], color=INK, linestyle=":", linewidth=0.9)
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlim(-reach, reach)
    axes.set_ylim(-0.6 * reach, 0.3 * reach)
    axes.set_xlabel("from the tip's middle [mm]")
