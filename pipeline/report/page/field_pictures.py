"""Pictures of fields: stress in the bent flexures, pressure where the tips touch the fruit."""

import math
from dataclasses import dataclass

import numpy as np

from cad.theory import hertz
from mesh.housing.sweep import flexure_mesh
from pipeline.report.page.drawing.legend import Entry, draw_legend
from pipeline.report.page.drawing.panel import DASHED, SERIES, Box, Panel
from pipeline.report.page.drawing.picture import Picture, Size, plot_panel, plot_picture
from pipeline.report.page.drawing.scale import Scale
from pipeline.report.stored import StoredReport
from pipeline.response.scene_press import scene_of
from pipeline.result import SensorResult
from pipeline.springs.mounts import attached_to
from solve.arrays import Floats
from solve.contact.pressure import footprint_pressure
from solve.housing.fields import flexure_fields

_COARSE = 2.0  # scale of the mesh of the picture: its stress is some per cent off, and a third of the time
_SYMMETRY = "symmetry"
_DRAWN_DEFLECTION = 0.025  # of the width, at most
_SHEET = 475.0  # [pt] wide
_CUT = 3.0  # mean pressures at which a plot ends: under the edge of a flat tip there is no bound
_PALETTE = ("#ffffcc", "#ffeda0", "#fed976", "#feb24c", "#fd8d3c", "#fc4e2a", "#e31a1c", "#bd0026", "#800026")
"""From no stress to the most: YlOrRd of C. Brewer, colorbrewer2.org."""


def flexure_picture(report: StoredReport, result: SensorResult) -> Picture:
    """Return the middle plane of the bent housing in the colours of its von Mises stress [MPa].

    Raises ValueError where there is no housing, SolveError.
    """
    housing = result.springs.housing
    if housing is None:
        msg = "no part is made"
        raise ValueError(msg)
    process = result.springs.process
    mesh = flexure_mesh(housing, _COARSE)
    pairs = zip(result.springs.springs, result.springs.deflections, strict=True)
    forces = [spring.stiffness * deflection for spring, deflection in pairs]
    fields = flexure_fields(mesh, process.E_MPa, process.poisson, forces, attached_to(housing))
    faces = mesh.facets[:, mesh.boundaries[_SYMMETRY]].T  # corners in turn, shape (faces, 4)
    nodes = len(fields.displacement)  # corners, then middles of edges
    at_rest = mesh.p[[0, 2], :nodes].T
    displacement = fields.displacement[:, [0, 2]]
    stress = fields.von_mises[faces].mean(axis=1)

    width = float(np.ptp(at_rest[:, 0]))
    factor = _deflection_factor(float(np.linalg.norm(displacement, axis=1).max()), width)
    bent = at_rest + factor * displacement
    limit = process.E_MPa * process.strain_limit
    highest = max(limit, float(fields.von_mises.max()))
    panel = _plane_panel(np.concatenate([at_rest[faces], bent[faces]]))
    panel.polygons(at_rest[faces], "var(--muted)", 0.25)
    colour = np.minimum(len(_PALETTE) * stress / highest, len(_PALETTE) - 1).astype(int)
    for index, shade in enumerate(_PALETTE):
        panel.polygons(bent[faces[colour == index]], shade)

    foot = panel.box.top + panel.box.height
    factors = [f"{name} spring {s.safety_factor:.3g}" for name, s in report.flexures.items() if s.safety_factor]
    caption = (
        f"Middle plane at full travel on the firmest fruit, deflection drawn {factor:g} times; largest von Mises "
        f"stress {float(fields.von_mises.max()):.3g} MPa, limit {limit:.3g} MPa (E of {process.name} times its strain "
        f"limit). Safety against the strain limit: {', '.join(factors)}."
    )
    panels = [panel, _stress_bar(foot + 55.0, limit, highest)]
    return plot_picture(panels, "flexure", "Flexures under load", caption, Size(_SHEET, foot + 104.0))


def _deflection_factor(deflection: float, width: float) -> float:
    """Return by how much deflections are drawn larger [1]: 1, 2 or 5 times a power of ten, at least 1."""
    factor = _DRAWN_DEFLECTION * width / deflection if deflection > 0.0 else 1.0
    if factor <= 1.0:
        return 1.0
    power = 10.0 ** math.floor(math.log10(factor))
    return max(digit * power for digit in (1.0, 2.0, 5.0) if digit * power <= factor)


def _plane_panel(points: Floats) -> Panel:
    """Return an empty panel in true proportions that shows all points (..., 2) [mm] with a margin."""
    low = points.min(axis=(0, 1))
    high = points.max(axis=(0, 1))
    margin = 0.04 * float(high[0] - low[0])
    x = Scale(start=float(low[0]) - margin, end=float(high[0]) + margin)
    z = Scale(start=float(low[1]) - margin, end=float(high[1]) + margin, steps=7)
    width = _SHEET - 60.0
    box = Box(left=52.0, top=6.0, width=width, height=width * (z.end - z.start) / (x.end - x.start))
    return Panel(name="flexure", box=box, x=x, y=z, x_label="x [mm]", y_label="z [mm]", grid=False)


def _stress_bar(top: float, limit: float, highest: float) -> Panel:
    """Return the colours of stress [MPa] at a level of the picture [pt], with a line at the limit."""
    panel = Panel(
        name="stress",
        box=Box(left=0.2 * _SHEET, top=top, width=0.6 * _SHEET, height=10.0),
        x=Scale(start=0.0, end=1.06 * highest),
        y=Scale(start=0.0, end=1.0, steps=1),
        x_label="von Mises stress [MPa]; the line is the limit",
        y_label=None,
        grid=False,
    )
    step = highest / len(_PALETTE)
    for index, shade in enumerate(_PALETTE):
        ends = [index * step, (index + 1) * step]
        panel.area(ends, [0.0, 0.0], ends, [1.0, 1.0], shade)
    panel.line([limit, limit], [0.0, 1.0], "black", 3.0)
    return panel


@dataclass(frozen=True, kw_only=True, eq=False)
class TipPressure:
    """The pressure [MPa] along the middle line of a tip, over the distance from its centre [mm], and its mean."""

    x: Floats
    pressure: Floats
    mean: float


def contact_picture(report: StoredReport, result: SensorResult) -> Picture:
    """Return the pressure [MPa] under one tip of each kind at the largest modulus and full travel.

    Raises ValueError where a tip is off the fruit or its pressure is not solved.
    """
    row = max(report.response, key=lambda row: row.E_MPa)
    pressures = {}
    for spring in ("low", "high"):
        index = next(index for index, tip in enumerate(report.tips) if tip.spring == spring)
        force = row.tip_forces[index][-1] or 0.0
        if force <= 0.0:
            msg = "a tip is off the fruit"
            raise ValueError(msg)
        if report.design.tips.dome_radius_mm is None:
            pressures[spring] = flat_tip_pressure(result, index, force)
        else:
            pressures[spring] = dome_pressure(report, row.E_MPa, force)
    half = max(float(np.abs(tip.x).max()) for tip in pressures.values())
    highest = max(min(1.08 * float(tip.pressure.max()), _CUT * tip.mean) for tip in pressures.values())
    x = Scale(start=-1.05 * half, end=1.05 * half)
    panel = plot_panel("contact", x, "from the middle of the tip [mm]", Scale(start=0.0, end=highest), "pressure [MPa]")
    entries = []
    for colour, (spring, tip) in zip(SERIES, pressures.items(), strict=False):
        panel.line(tip.x, tip.pressure, colour)
        panel.level(tip.mean, colour, 0.9, DASHED)
        entries.append(Entry(text=f"tip on the {spring} spring", colour=colour))
    draw_legend(panel, "lower right", entries)
    means = ", ".join(f"{spring} tip {tip.mean:.3g} MPa in the mean" for spring, tip in pressures.items())
    caption = f"On a fruit of {row.E_MPa:g} MPa at full travel, along the tips: {means} (dashed)."
    return plot_picture([panel], "contact", "Pressure where the tips touch", caption)


def flat_tip_pressure(result: SensorResult, tip: int, force: float) -> TipPressure:
    """Return the pressure under the middle line of a flat tip that carries a force [N]; raises InputError."""
    design = result.design
    scene = scene_of(design, result.press.height_offsets)
    E = float(result.press.at_largest_E.E[-1])
    contact = footprint_pressure(scene, result.contact, result.springs.C, E, design.press.travel_mm)
    sizes = np.diff(contact.edges)
    middle = len(sizes) // 2
    pressure = contact.cell_forces[tip, :, middle] / (sizes * sizes[middle])
    centres = 0.5 * (contact.edges[1:] + contact.edges[:-1])
    return TipPressure(x=centres, pressure=pressure, mean=force / design.tips.face_mm2)


def dome_pressure(report: StoredReport, E: float, force: float) -> TipPressure:
    """Return Hertz's pressure under a dome at modulus E [MPa] and a force [N].

    K. L. Johnson, Contact Mechanics, (4.22).
    """
    radius = contact_radius(report, E, force)
    x = np.linspace(-radius, radius, 121)
    mean = force / (math.pi * radius**2)
    pressure = 1.5 * mean * np.sqrt(np.maximum(0.0, 1.0 - (x / radius) ** 2))
    return TipPressure(x=x, pressure=pressure, mean=mean)


def contact_radius(report: StoredReport, E: float, force: float) -> float:
    """Return the radius that a dome touches with [mm] at modulus E [MPa] and a force [N]; Hertz."""
    fruit = report.design.fruit
    dome = report.design.tips.dome_radius_mm or math.inf
    return hertz.contact_radius(force, E, fruit.poisson, hertz.mean_relative_curvature(dome, *fruit.radii_mm))
