"""A picture of a scene: a deformed body coloured by a field, with a colour bar and a ruler."""

import textwrap
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pyvista as pv

from pipeline.report.page.page_bodies import deformation_factor
from sensor.words import round_below

Mesh = Any  # a PyVista data set; its decorated methods have no types that mypy's strict mode accepts
Plotter = Any

DISPLACEMENT = "displacement_mm"
BODY = "#c8ccd2"
EDGE = "#30343a"
PALETTE = "YlOrRd"  # pale for low values, so that the shape stays visible
SUBDIVISION = 3  # number of times that each facet of a second-order cell is halved, so that it looks curved
_SHARP_EDGE_DEG = 25.0  # smallest angle between two facets at a sharp edge
_ZOOM = 0.75  # less than 1, so that there is space for the title, the ruler and the colour bar
_NARROW = 900  # largest width of a picture [pixels] at which the colour bar has few numbers
_RULER_GAP = 0.06  # distance of the ruler below the body, as a fraction of the diagonal of the picture's bounds
_TITLE_SIZE = 11  # font size of a title
_LETTER_WIDTH = 1.35  # average width of a letter in a title [pixels], divided by the font size


class Vector(NamedTuple):
    """A point [mm] or a direction [1]."""

    x: float
    y: float
    z: float


FRONT = Vector(0.25, -1.0, 0.45)
"""Direction from a body to the viewer, who looks at its front from above."""


@dataclass(frozen=True, kw_only=True)
class Field:
    """A scalar field: the name of the array with its values at the nodes, and its title with the unit."""

    array: str
    title: str

    def range_on(self, mesh: Mesh) -> tuple[float, float]:
        """Return the range of the colour scale: from 0, or from the minimum if it is negative, to the maximum."""
        values = np.asarray(mesh.point_data[self.array])
        return min(0.0, float(values.min())), float(values.max())


@dataclass(frozen=True, kw_only=True, eq=False)
class FieldPicture:
    """The mesh [mm] of a whole body, the fields that can colour it, and the view.

    The first field is the default. If `enlarged` is true, small displacements are drawn on a larger scale. `direction`
    points from the body to the viewer. `cut_y` [mm] is the y coordinate of the plane at which the body is cut open, or
    None for an uncut body. `focus` holds the bounds of the picture [mm]: minimum and maximum x, then y, then z. If
    `focus` is None, the picture shows the whole body.
    """

    name: str
    title: str
    mesh: Mesh
    fields: tuple[Field, ...]
    enlarged: bool = False
    direction: Vector = FRONT
    cut_y: float | None = None
    focus: tuple[float, ...] | None = None

    @property
    def caption(self) -> str:
        """Return the title of the scene, the scale of the displacements, and the largest displacement, as text."""
        scale = "as they are" if self.factor == 1.0 else f"{self.factor:g} times"
        return f"{self.title}; displacements drawn {scale}, at most {self.largest_displacement_mm:.3g} mm"

    @property
    def factor(self) -> float:
        """Return the factor [1] by which displacements are enlarged in the picture."""
        return deformation_factor(self.largest_displacement_mm, float(self.mesh.length)) if self.enlarged else 1.0

    @property
    def largest_displacement_mm(self) -> float:
        """Return the largest displacement of a node [mm], before it is enlarged."""
        return float(np.linalg.norm(self.mesh.point_data[DISPLACEMENT], axis=1).max())


def deformed_surface(scene: FieldPicture, subdivision: int = SUBDIVISION) -> tuple[Mesh, Mesh]:
    """Return the undeformed surface of a scene [mm], and its surface displaced in the scale of the drawing [mm].

    `subdivision` is the number of times that each facet of a second-order cell is halved.
    """
    mesh = scene.mesh
    if scene.cut_y is not None:
        # The viewer is on the side of negative y, so the part in front of the plane is removed.
        mesh = mesh.clip(normal=(0.0, -1.0, 0.0), origin=(0.0, scene.cut_y, 0.0))
    surface = mesh.extract_surface(algorithm="dataset_surface", nonlinear_subdivision=subdivision)
    return surface, surface.warp_by_vector(DISPLACEMENT, factor=scene.factor)


def draw_scene(plotter: Plotter, scene: FieldPicture, field: Field | None = None) -> None:
    """Draw a scene coloured by one of its fields (by default the first), and the edges of the undeformed body.

    The colour bar has the title and the range of the field. Colours, line widths and positions were chosen by eye.
    """
    field = field or scene.fields[0]
    # Options of PyVista for the colour bar.
    colour_bar: dict[str, object] = {
        # VTK merges colour bars that have the same title, so the title includes the name of the scene.
        "title": f"{scene.name}: {field.title}\n",
        "color": "black",
        "fmt": "%.3g",
        "n_labels": 5 if _width(plotter) > _NARROW else 3,
        "vertical": False,
        # Positions and sizes are fractions of the picture.
        "position_x": 0.25,
        "position_y": 0.03,
        "width": 0.5,
        "height": 0.08,
    }
    undeformed, deformed = deformed_surface(scene)
    plotter.add_mesh(sharp_edges(undeformed), color=EDGE, line_width=1, opacity=0.35)
    plotter.add_mesh(
        deformed,
        scalars=field.array,
        clim=list(field.range_on(scene.mesh)),
        cmap=PALETTE,
        ambient=0.35,
        smooth_shading=True,
        split_sharp_edges=True,
        scalar_bar_args=colour_bar,
    )
    plotter.add_mesh(sharp_edges(deformed), color=EDGE, line_width=1.5)
    frame_picture(plotter, scene.mesh, scene.caption, scene.direction, scene.focus)


def draw_part(plotter: Plotter, part: Mesh, title: str, direction: Vector) -> None:
    """Draw the surface and the edges of a part [mm]; `direction` points from the part to the viewer."""
    plotter.add_mesh(part, color=BODY, smooth_shading=True, split_sharp_edges=True, ambient=0.15)
    plotter.add_mesh(sharp_edges(part), color=EDGE, line_width=2)
    frame_picture(plotter, part, title, direction)


def draw_cells(plotter: Plotter, mesh: Mesh, title: str) -> None:
    """Draw the surface of a mesh with the edges of its cells, without fields."""
    surface = mesh.linear_copy().extract_surface(algorithm="dataset_surface")
    plotter.add_mesh(surface, color=BODY, ambient=0.15, show_edges=True, edge_color=EDGE, line_width=1)
    frame_picture(plotter, mesh, title, FRONT)


def sharp_edges(surface: Mesh) -> Mesh:
    """Return the sharp edges of a surface as a mesh of lines."""
    return surface.extract_feature_edges(
        feature_angle=_SHARP_EDGE_DEG, boundary_edges=False, non_manifold_edges=False, manifold_edges=False
    )


def frame_picture(
    plotter: Plotter, mesh: Mesh, title: str, direction: Vector, focus: tuple[float, ...] | None = None
) -> None:
    """Add a title and a ruler to a picture, and point the camera at the body, or at the bounds `focus` [mm] if given.

    `mesh` is the body [mm], and `direction` points from the body to the viewer. `focus` holds minimum and maximum x,
    then y, then z. A title that is wider than the picture is wrapped.
    """
    bounds = focus or tuple(mesh.bounds)  # the bounds of VTK have the same order as `focus`
    letters_per_line = max(1, int(_width(plotter) / (_LETTER_WIDTH * _TITLE_SIZE)))
    lines = textwrap.wrap(title, letters_per_line)
    plotter.add_text("\n".join(lines), position="upper_edge", font_size=_TITLE_SIZE, color="black")
    _add_ruler(plotter, bounds, seen_from_above=direction[2] > 0.0)
    plotter.enable_anti_aliasing("ssaa")  # supersampling, the smoothest method of VTK
    plotter.enable_parallel_projection()  # so that the ruler holds at every depth
    plotter.view_vector(direction, viewup=(0.0, 0.0, 1.0), bounds=bounds)
    plotter.camera.zoom(_ZOOM)


def _add_ruler(plotter: Plotter, bounds: tuple[float, ...], *, seen_from_above: bool) -> None:
    """Add a ruler with its length as a label, parallel to x and below the front of the body.

    `bounds` [mm] are minimum and maximum x, then y, then z. The length of the ruler is a round number, at most a
    quarter of the width of the body.
    """
    left, right, front, back, bottom, top = bounds
    ruler_mm = round_below(0.25 * (right - left))
    diagonal = float(np.linalg.norm([right - left, back - front, top - bottom]))
    start = np.array([left, front, bottom - _RULER_GAP * diagonal])
    plotter.add_mesh(pv.Line(start, start + np.array([ruler_mm, 0.0, 0.0])), color=EDGE, line_width=4)
    plotter.add_point_labels(
        [start],
        [f"{ruler_mm:g} mm"],
        text_color=EDGE,
        shape=None,
        show_points=False,
        always_visible=True,
        # If the body is seen from below, the ruler is at the top of the picture.
        justification_vertical="bottom" if seen_from_above else "top",
    )


def _width(plotter: Plotter) -> float:
    """Return the width [pixels] of the picture, or of the active part of a window with several pictures."""
    left, _, right, _ = plotter.renderer.viewport  # fractions of the window
    return float(plotter.window_size[0] * (right - left))
