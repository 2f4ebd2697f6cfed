"""The scene of the assembly: every body in its colour, in place or drawn apart."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pyvista as pv

from cad.parts.assembly import assembly_bodies, sensor_of
from cad.parts.sensor import Body
from pipeline.report.stored import StoredReport
from pipeline.view.scenes.stage import ACCENT, EDGE, add_labels, add_rule, add_title, light_body, look_at, sharp_edges

Mesh = Any  # a PyVista data set: its decorated methods have no types that strict mode takes
Plotter = Any

_CHORD_MM = 0.05
_ANGLE = 0.2  # rad between two facets of a curved face
_APART = 4.0  # how many times its place across the sensor a body is moved outwards
_DIRECTION = (0.55, -1.0, 0.5)
_APART_DIRECTION = (1.0, -0.9, 0.75)


@dataclass(frozen=True, kw_only=True, eq=False)
class DrawnBody:
    """A body as triangles [mm], its name and its colour (red, green, blue from 0 to 1)."""

    name: str
    surface: Mesh
    colour: tuple[float, float, float]


def assembly(report: StoredReport) -> tuple[DrawnBody, ...]:
    """Return every body of the sensor over its fruit [mm]; none where the design has no housing."""
    if report.housing is None:
        return ()
    return tuple(map(_drawn, assembly_bodies(sensor_of(report.design, report.housing))))


def _drawn(body: Body) -> DrawnBody:
    vertices, triangles = body.shape.tessellate(_CHORD_MM, _ANGLE)
    points = np.array([vertex.toTuple() for vertex in vertices])
    surface = pv.PolyData.from_regular_faces(points, np.array(triangles))
    return DrawnBody(name=body.name, surface=surface.clean(), colour=body.colour)


def drawn_apart(bodies: tuple[DrawnBody, ...]) -> tuple[DrawnBody, ...]:
    """Return the bodies moved outwards across the sensor, so that each shows; what stands in the middle stays."""

    def moved(body: DrawnBody) -> DrawnBody:
        across = float(np.asarray(body.surface.center)[1])
        surface = body.surface.translate((0.0, _APART * across, 0.0))
        return DrawnBody(name=body.name, surface=surface, colour=body.colour)

    return tuple(map(moved, bodies))


def _top(body: DrawnBody) -> tuple[float, float, float]:
    """Return the middle of the upper end of a body [mm]."""
    x, y, _ = body.surface.center
    return x, y, body.surface.bounds[5]


def draw_bodies(plotter: Plotter, bodies: tuple[DrawnBody, ...]) -> None:
    """Draw bodies in their colours, with their edges."""
    for body in bodies:
        plotter.add_mesh(body.surface, color=body.colour, smooth_shading=True, split_sharp_edges=True, ambient=0.2)
        plotter.add_mesh(sharp_edges(body.surface), color=EDGE, line_width=1)


def draw_assembly(plotter: Plotter, bodies: tuple[DrawnBody, ...], title: str, *, named: bool = False) -> None:
    """Draw bodies in their colours, with their names where asked for."""
    light_body(plotter)
    draw_bodies(plotter, bodies)
    whole = pv.merge([body.surface for body in bodies])
    if named:
        first = {body.name.rstrip("0123456789 "): body for body in reversed(bodies)}
        add_labels(plotter, [_top(body) for body in first.values()], list(first), ACCENT, 18)
    add_title(plotter, title)
    add_rule(plotter, whole)
    look_at(plotter, _APART_DIRECTION if named else _DIRECTION, whole)
