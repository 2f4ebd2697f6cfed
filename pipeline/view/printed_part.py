"""The printed part on its bed, its tips named."""

from typing import Any

import numpy as np

from cad.design.parameters import Design
from cad.design.tips import Tips
from pipeline.view.scenes.stage import BODY, EDGE, add_labels, add_rule, add_title, light_body, look_at, sharp_edges

Mesh = Any  # a PyVista data set: its decorated methods have no types that strict mode takes
Plotter = Any

_NEAR = 1e-4  # mm, the digits of an STL file
_AWAY = 0.25  # how far beyond its tip a letter stands, of the way from the middle of the part


def draw_printed_part(plotter: Plotter, part: Mesh, design: Design) -> None:
    """Draw the triangles of a housing [mm] as it is printed, L at the low tip and H at the high one."""
    light_body(plotter)
    plotter.add_mesh(part, color=BODY, smooth_shading=True, split_sharp_edges=True, ambient=0.15)
    plotter.add_mesh(sharp_edges(part), color=EDGE, line_width=2)
    tips = tip_points(np.asarray(part.points), design.tips)
    if tips is not None:
        away = tips - np.asarray(part.center)
        away[:, 0] = 0.0
        add_labels(plotter, tips + _AWAY * away, ["L", "H"], size=34)
    size = " x ".join(f"{length:.1f}" for length in np.ptp(np.asarray(part.points), axis=0))
    add_title(plotter, f"{design.name}: housing as printed, {size} mm; L low spring, H high spring")
    add_rule(plotter, part)
    look_at(plotter, (0.35, -0.75, 1.0), part)


def tip_points(points: np.ndarray[Any, Any], tips: Tips) -> np.ndarray[Any, Any] | None:
    """Return the centres of the low and the high tip face, shape (2, 3) [mm], or None where the part shows none.

    The tips are the only faces at one end of the part, and they span spacing plus side along x.
    """
    side, spacing = tips.side_mm, tips.spacing_mm
    for axis in (1, 2):
        for end in (points[:, axis].min(), points[:, axis].max()):
            face = points[np.abs(points[:, axis] - end) < _NEAR]
            x = face[:, 0]
            if abs(np.ptp(x) - spacing - side) < 10.0 * _NEAR:
                halves = (face[x < x.mean()], face[x > x.mean()])
                return np.array([0.5 * (half.min(axis=0) + half.max(axis=0)) for half in halves])
    return None
