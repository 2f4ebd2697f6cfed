"""What is drawn for a browser: one scene of the sensor under the press that the sliders ask for."""

from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv

from cad.quantity import InputError
from pipeline.report.stored import StoredReport
from pipeline.view.loaded_sensor import LoadedHousing, as_drawn, forces_at, fruit_under, housing_of
from pipeline.view.scenes.assembly import DrawnBody, assembly, draw_assembly
from pipeline.view.scenes.field import Field
from pipeline.view.scenes.flexures import flexure_scenes
from pipeline.view.scenes.fruit import fruit_scene
from pipeline.view.scenes.scene import Cut, FieldScene, deformed_surface, draw_scene
from solve.housing.stiffness import SPRINGS
from solve.linear import SolveError

Plotter = Any  # a PyVista plotter: its decorated methods have no types that strict mode takes
Mesh = Any
Vector = tuple[float, float, float]

ASSEMBLY, FRUIT = "assembly", "fruit"
AXES = ("x", "y", "z")
_KEPT = 8  # fields of the fruit that are not solved again


@dataclass(frozen=True, kw_only=True)
class View:
    """What is asked for: scene, field by its array, modulus [MPa], travel [mm], factor of the displacements, cut.

    `factor` 0 stands for that of the scene. `cut_axis` is "x", "y", "z" or "" for none, `cut_at` a share of the body.
    """

    scene: str
    field: str = ""
    E_MPa: float
    x_mm: float
    factor: float = 0.0
    cut_axis: str = ""
    cut_at: float = 0.5


@dataclass(frozen=True, kw_only=True)
class Probe:
    """The value of a field at a place [mm] of the body before it is pressed; None outside the body."""

    place: Vector
    value: float | None


@dataclass(eq=False)
class ServedScenes:
    """The scenes of a report and its folder; the housing is solved once, the fruit for each press that is looked at."""

    report: StoredReport
    folder: Path
    housing: LoadedHousing = field(init=False)
    bodies: tuple[DrawnBody, ...] = field(init=False)

    def __post_init__(self) -> None:
        """Solve the housing under unit loads; raises InputError where there is none, SolveError."""
        self.housing = housing_of(self.report, self.folder)
        self.bodies = assembly(self.report)
        self._fruit = lru_cache(maxsize=_KEPT)(self._solved_fruit)

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the scenes."""
        return (*(f"flexure-{spring}" for spring in SPRINGS), FRUIT, ASSEMBLY)

    def field_scene(self, view: View) -> FieldScene | None:
        """Return the scene of a view with its fields; None for the assembly. Raises InputError, SolveError."""
        if view.scene == ASSEMBLY:
            return None
        scene = self._fruit(view.E_MPa, view.x_mm) if view.scene == FRUIT else self._flexure(view)
        if scene is None:
            return None
        scene = replace(scene, factor=view.factor or scene.factor)
        return replace(scene, cut=_cut(scene.mesh, view)) if view.cut_axis else scene

    def _flexure(self, view: View) -> FieldScene:
        forces = forces_at(self.report.response, view.E_MPa, view.x_mm)
        half = as_drawn(self.housing.mesh, self.housing.under(forces))
        scene = flexure_scenes(self.report, half)[self.names.index(view.scene)]
        force = forces[self.names.index(view.scene)]
        return replace(scene, title=f"{scene.title} under {force:.3g} N")

    def _solved_fruit(self, E: float, x: float) -> FieldScene | None:
        scene = fruit_scene(self.report.design, as_drawn(*fruit_under(self.report, self.folder, E, x)))
        return None if scene is None else replace(scene, title=f"{scene.title}; E {E:.3g} MPa, travel {x:.3g} mm")

    def draw(self, plotter: Plotter, view: View) -> str | None:
        """Draw a view in an emptied plotter; return in a sentence why it cannot be drawn, None where it was."""
        try:
            scene = self.field_scene(view)
        except (InputError, SolveError) as error:
            return str(error)
        plotter.clear()
        if scene is None:
            draw_assembly(plotter, self.bodies, f"{self.report.design.name}: the sensor over its fruit")
        else:
            draw_scene(plotter, scene, chosen_field(scene, view))
        return None

    def probed(self, view: View, place: Vector) -> Probe:
        """Return the value of the field of a view at a place [mm] of the body before it is pressed."""
        scene = self.field_scene(view)
        if scene is None:
            return Probe(place=place, value=None)
        found = pv.PolyData(np.array([place])).sample(scene.mesh)
        inside = bool(found.point_data["vtkValidPointMask"][0])
        value = float(found.point_data[chosen_field(scene, view).array][0])
        return Probe(place=place, value=value if inside else None)

    def picked(self, view: View, place: Vector) -> Probe:
        """Return the value of the field at the node that is drawn nearest to a place [mm], and where that node was."""
        scene = self.field_scene(view)
        if scene is None:
            return Probe(place=place, value=None)
        before, moved = deformed_surface(scene)
        node = int(moved.find_closest_point(place))
        x, y, z = np.asarray(before.points)[node].tolist()
        return Probe(place=(x, y, z), value=float(moved.point_data[chosen_field(scene, view).array][node]))


def chosen_field(scene: FieldScene, view: View) -> Field:
    """Return the field that a view asks for, the first of the scene where it has none of that name."""
    return next((each for each in scene.fields if each.array == view.field), scene.fields[0])


def _cut(mesh: Mesh, view: View) -> Cut:
    axis = AXES.index(view.cut_axis)
    lower, upper = np.array(mesh.bounds).reshape(3, 2).T
    origin, normal = 0.5 * (lower + upper), np.zeros(3)
    origin[axis] = lower[axis] + min(max(view.cut_at, 0.01), 0.99) * (upper[axis] - lower[axis])
    normal[axis] = -1.0 if axis == 1 else 1.0
    (x, y, z), (u, v, w) = origin.tolist(), normal.tolist()
    return Cut(origin=(x, y, z), normal=(u, v, w))
