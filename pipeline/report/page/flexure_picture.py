"""The flexures under full travel: the middle plane as it is bent, in the colours of its stress."""

import math

import numpy as np

from pipeline.report.page.drawing.panel import DOTTED, MUTED, Box, Panel
from pipeline.report.page.drawing.picture import Picture, Pixels, plot_picture, png_address
from pipeline.report.page.drawing.raster import FINE, frontmost, reduced
from pipeline.report.page.drawing.scale import Scale
from pipeline.report.page.fields import Fields, FlexureSection, Floats, Ints
from pipeline.report.stored import StoredReport

_DRAWN = 0.025  # largest deflection as drawn, as a share of the width
_OUTLINE = "#505050"  # on the pale shades of little stress, in light and dark
_SHADES = (0xFFFFCC, 0xFFEDA0, 0xFED976, 0xFEB24C, 0xFD8D3C, 0xFC4E2A, 0xE31A1C, 0xBD0026, 0x800026)
"""From no stress to the most: YlOrRd of C. Brewer, colorbrewer2.org."""
_STEPS = 256  # of colour
_PIXELS = 1.6  # each way for a point of a picture of fields
_SHEET = 475.0  # [pt] wide: pictures of fields
_CORNERS = ((7, 0, 1), (1, 2, 3), (3, 4, 5), (5, 6, 7), (7, 1, 3), (7, 3, 5))
"""Triangles of a face of eight nodes, corners and middles in turn."""


def flexure_picture(report: StoredReport, fields: Fields) -> Picture | None:
    """Return the deflected flexures with von Mises stress [MPa] and the limit; None where no stress is known."""
    section = fields.flexure
    if section is None:
        return None
    process = report.design.process
    limit, largest = process.E_MPa * process.strain_limit, float(section.stress.max())
    width = float(np.ptp(section.places[:, 0]))
    factor = _drawn_factor(float(np.linalg.norm(section.moves, axis=1).max()), width)
    most = 1.06 * max(limit, largest)
    panel = _draw_flexure(section, factor, most)
    foot = panel.box.top + panel.box.height
    bar = _stress_bar(foot + 55.0, limit, most)
    caption = (
        f"Middle plane at full travel on the firmest fruit, deflection drawn {factor:g} times; largest von Mises "
        f"stress {largest:.3g} MPa, limit {limit:.3g} MPa (E of {process.name} times its strain limit). "
        f"Safety against the strain limit: {_safety(report)}."
    )
    words = (caption, f"Front view of the bent leaves. {caption}")
    return plot_picture([panel, bar], "flexure", "Flexures under load", words, (_SHEET, foot + 104.0))


def _safety(report: StoredReport) -> str:
    known = ((name, spring.safety_factor) for name, spring in report.springs.items())
    return ", ".join(f"{name} spring {factor:.3g}" for name, factor in known if factor is not None) or "not known"


def _draw_flexure(section: FlexureSection, factor: float, most: float) -> Panel:
    """Return a panel with the section moved by so many times its moves, coloured by stress up to `most` [MPa]."""
    moved = section.places + factor * section.moves
    x, y = _scales(np.concatenate([section.places, moved]))
    wide = _SHEET - 60.0
    box = Box(left=52.0, top=6.0, width=wide, height=wide * (y.end - y.start) / (x.end - x.start))
    panel = Panel(name="flexure", box=box, x=x, y=y, x_label="x [mm]", y_label="z [mm]", grid=False)
    panel.image(png_address(_shaded(panel, moved, section, most)), box)
    outline = _outline(section.faces)
    panel.lines(section.places[outline], MUTED, 0.5, DOTTED)
    panel.lines(moved[outline], _OUTLINE, 0.7)
    return panel


def _scales(places: Floats) -> tuple[Scale, Scale]:
    """Return scales [mm] that show all places (n, 2) [mm] with a margin."""
    least, most = places.min(axis=0), places.max(axis=0)
    margin = 0.04 * float(most[0] - least[0])
    x, y = zip((least - margin).tolist(), (most + margin).tolist(), strict=True)
    return Scale(start=x[0], end=x[1]), Scale(start=y[0], end=y[1], steps=7)


def _shaded(panel: Panel, moved: Floats, section: FlexureSection, most: float) -> Pixels:
    """Return the pixels of a panel with moved faces in the colours of their stress, up to `most` [MPa]."""
    box = panel.box
    size = (round(_PIXELS * box.width), round(_PIXELS * box.height))
    away = (panel.places(*moved.T) - np.array([box.left, box.top])) / np.array([box.width, box.height])
    corners = np.column_stack([FINE * away * np.array(size), section.stress])
    triangles = np.concatenate([section.faces[:, list(corner)] for corner in _CORNERS])
    front, stress = frontmost(corners[triangles], size)
    shades = np.round(np.where(front < 0, 0.0, stress) * (_STEPS - 1) / most).astype(np.int64)
    return reduced(np.where(front < 0, -1, shades), _colours())


def _colours() -> Floats:
    """Return red, green and blue (steps, 3), from 0 to 1, for equal steps of stress from none to the largest shown."""
    shades = np.array([[shade >> 16, shade >> 8 & 0xFF, shade & 0xFF] for shade in _SHADES]) / 255.0
    shares, places = np.linspace(0.0, 1.0, _STEPS), np.linspace(0.0, 1.0, len(shades))
    return np.stack([np.interp(shares, places, shade) for shade in shades.T], axis=-1)


def _outline(faces: Ints) -> Ints:
    """Return the edges that belong to one face only, as three nodes each, shape (edges, 3)."""
    edges = np.concatenate([faces[:, [start, start + 1, (start + 2) % 8]] for start in (0, 2, 4, 6)])
    _, first, count = np.unique(edges[:, 1], return_index=True, return_counts=True)
    alone: Ints = edges[first[count == 1]]
    return alone


def _stress_bar(top: float, limit: float, most: float) -> Panel:
    """Return the scale of stress [MPa] at a level of the picture [pt], with a line at the limit."""
    box, x = Box(left=0.2 * _SHEET, top=top, width=0.6 * _SHEET, height=10.0), Scale(start=0.0, end=most)
    label = "von Mises stress [MPa]; the line is the limit"
    panel = Panel(
        name="stress", box=box, x=x, y=Scale(start=0.0, end=1.0, steps=1), x_label=label, y_label=None, grid=False
    )
    pixels = np.concatenate([_colours(), np.ones((_STEPS, 1))], axis=1)
    panel.image(png_address(np.asarray(np.round(255.0 * pixels[None]), dtype=np.uint8)), box)
    panel.line([limit, limit], [0.0, 1.0], "black", 3.0)
    return panel


def _drawn_factor(deflection: float, width: float) -> float:
    """Return by how much deflections are drawn larger [1]: 1, 2 or 5 times a power of ten, at least 1."""
    wanted = _DRAWN * width / deflection if deflection > 0.0 else 1.0
    power = 10.0 ** math.floor(math.log10(max(wanted, 1.0)))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= max(wanted, 1.0))
