"""A scene: a body with its fields, deformed and in colour, with a bar for the colours and a rule for the size."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from pipeline.view.scenes.field import DISPLACEMENT, Field
from pipeline.view.scenes.stage import BODY, EDGE, add_rule, add_title, light_body, look_at, picture_size, sharp_edges

Mesh = Any  # a PyVista data set: its decorated methods have no types that strict mode takes
Plotter = Any
ColourBar = dict[str, object]  # what PyVista takes
Vector = tuple[float, float, float]

COLOURS = "YlOrRd"  # pale where there is little: the shape stays readable
FACETS = 3  # how often the facet of a quadratic cell is halved
_NARROW = 900  # pixels: below, a bar has fewer and smaller numbers
_DRAWN = 0.08  # largest displacement as drawn, as a share of the part's diagonal


@dataclass(frozen=True, kw_only=True, eq=False)
class Cut:
    """A plane that takes away what lies on the side of its normal: a point on it [mm] and the normal [1]."""

    origin: Vector
    normal: Vector


@dataclass(frozen=True, kw_only=True, eq=False)
class FieldScene:
    """A whole mesh [mm] with its fields, the first one shown unless told, and how it is looked at.

    `factor` is by how much displacements are drawn larger [1], `direction` points from the body to the eye, `focus`
    are the ends of the box that fills the picture [mm], the whole body where it is None.
    """

    name: str
    title: str
    mesh: Mesh
    fields: tuple[Field, ...]
    factor: float
    direction: Vector
    cut: Cut | None = None
    focus: tuple[Vector, Vector] | None = None

    @property
    def caption(self) -> str:
        """Return the title, and how the displacements are drawn."""
        drawn = "as they are" if self.factor == 1.0 else f"{self.factor:g} times"
        return f"{self.title}; displacements drawn {drawn}, at most {self.largest_displacement_mm:.3g} mm"

    @property
    def largest_displacement_mm(self) -> float:
        """Return the largest displacement [mm]."""
        return float(np.linalg.norm(self.mesh.point_data[DISPLACEMENT], axis=1).max())


def deformation_factor(largest_mm: float, length_mm: float) -> float:
    """Return by how much displacements are drawn larger [1]: 1, or 1, 2 or 5 times a power of ten."""
    wanted = _DRAWN * length_mm / largest_mm if largest_mm > 0.0 else 1.0
    if wanted <= 1.0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(power * max(step for step in (1.0, 2.0, 5.0) if step * power <= wanted * (1.0 + 1e-12)))


def deformed_surface(scene: FieldScene, facets: int = FACETS) -> tuple[Mesh, Mesh]:
    """Return the surface of a scene [mm] before and after the deformation as it is drawn.

    `facets` is how often the facet of a quadratic cell is halved.
    """
    mesh = scene.mesh
    if scene.cut is not None:
        mesh = mesh.clip(normal=scene.cut.normal, origin=scene.cut.origin)
    surface = mesh.extract_surface(algorithm="dataset_surface", nonlinear_subdivision=facets)
    return surface, surface.warp_by_vector(DISPLACEMENT, factor=scene.factor)


def draw_scene(plotter: Plotter, scene: FieldScene, field: Field | None = None) -> None:
    """Draw a scene in the colours of one of its fields, over the outline of the body before it is pressed."""
    shown = field or scene.fields[0]
    draw_body(plotter, scene, shown, colour_bar(plotter, scene, shown))
    add_title(plotter, scene.caption)
    add_rule(plotter, scene.mesh, scene.focus)
    look_at(plotter, scene.direction, scene.mesh, scene.focus)


def draw_body(
    plotter: Plotter, scene: FieldScene, field: Field, bar: ColourBar | None = None, facets: int = FACETS
) -> None:
    """Draw the body of a scene alone, with a bar of its colours where one is given."""
    before, moved = deformed_surface(scene, facets)
    light_body(plotter)
    plotter.add_mesh(sharp_edges(before), color=EDGE, line_width=1, opacity=0.35)
    plotter.add_mesh(
        moved,
        scalars=field.array,
        clim=list(field.range_on(scene.mesh)),
        cmap=COLOURS,
        ambient=0.35,
        smooth_shading=True,
        split_sharp_edges=True,
        show_scalar_bar=bar is not None,
        scalar_bar_args=bar,
    )
    plotter.add_mesh(sharp_edges(moved), color=EDGE, line_width=1.5)


def colour_bar(plotter: Plotter, scene: FieldScene, field: Field) -> ColourBar:
    """Return how the bar of a field is drawn; its title is that of one scene, for bars of one title are one bar."""
    wide = picture_size(plotter)[0] > _NARROW
    text = {"title": f"{scene.name}: {field.title}\n", "color": "black", "fmt": "%.3g", "n_labels": 5 if wide else 3}
    place = {"vertical": False, "position_x": 0.25, "position_y": 0.03, "width": 0.5, "height": 0.08}
    return {**text, **place, "title_font_size": 20 if wide else 14, "label_font_size": 18 if wide else 12}


def draw_plain(plotter: Plotter, mesh: Mesh, title: str) -> None:
    """Draw a mesh without fields, its cells to be seen."""
    light_body(plotter)
    linear = mesh.linear_copy() if hasattr(mesh, "linear_copy") else mesh
    surface = linear.extract_surface(algorithm="dataset_surface")
    plotter.add_mesh(surface, color=BODY, ambient=0.15, show_edges=True, edge_color=EDGE, line_width=1)
    add_title(plotter, title)
    add_rule(plotter, mesh)
    look_at(plotter, (0.25, -1.0, 0.45), mesh)
