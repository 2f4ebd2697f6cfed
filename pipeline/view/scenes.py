"""Scenes of an output folder: each spring, the fruit, and the assembly."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyvista as pv
from vtkmodules.vtkFiltersGeneral import vtkReflectionFilter

from cad.parts.assembly import assembly_of, colour_of, in_place, outwards, sensor_of
from pipeline.making.field_files import FLEXURE, FRUIT
from pipeline.report.report import Report
from pipeline.view.field_picture import DISPLACEMENT, EDGE, Field, FieldPicture, Vector, frame, sharp_edges
from sensor.arrays import Floats
from sensor.design.parameters import Design
from sensor.quantity import validation_error
from solve.fruit.bent_block import core_of
from solve.fruit.curved_shape import CurvedShape
from solve.fruit.smooth_load import smooth_loads
from solve.fruit.split import contact_footprints
from solve.housing.stiffness import SPRINGS, tip_face

if TYPE_CHECKING:
    import cadquery as cq

Mesh = Any  # a PyVista data set: its decorated methods have no types that strict mode takes
Plotter = Any

SYMMETRY = "symmetry"  # marks the nodes on the plane y = 0 of a half model
STRAIN = "largest_principal_strain"
STRESS = "stress_MPa"

VON_MISES = Field(array="von_mises_MPa", title="von Mises stress [MPa]")
TOTAL_DISPLACEMENT = Field(array="total_displacement_mm", title="displacement [mm]")
LARGEST_STRAIN = Field(array=STRAIN, title="largest principal strain [1]")
STRAIN_OVER_LIMIT = Field(array="strain_over_limit", title="strain / limit of the leaves [1]")
VERTICAL_PRESSURE = Field(array="vertical_pressure_MPa", title="pressure along the press [MPa]")

_ZZ = 2  # index in xx, yy, zz, xy, yz, xz
_FOCUS = 0.4  # extent of the fruit's picture around the tips, as a fraction of their spacing
_CHORD_MM = 0.05
_FACET_ANGLE = 0.2  # [rad]
_LEADER = 0.13  # step between names, as a fraction of the height of the picture
_FRUIT_DOWN = 1.2  # displacement of the fruit in the exploded view, as a fraction of its height
_TIP_ASIDE = 0.3  # sideways distance of a tip's name from the fruit, as a fraction of the sensor's length
_AS_LOW_MM = 1e-3  # tips whose heights differ by less are equal
ASSEMBLY_DIRECTION = Vector(0.55, -1.0, 0.5)
_APART_DIRECTION = Vector(0.7, -1.0, -0.35)  # from below, where the tips are visible


def read_mesh(path: Path) -> Mesh:
    """Return the mesh of a file; raises InputError if it has no cells."""
    data = pv.read(path)
    if not getattr(data, "n_cells", 0):
        bound = "a mesh with at least one cell"
        raise validation_error("file", str(path), "", bound, "write it again with pipeline run")
    return data


def field_scenes(report: Report, folder: Path) -> tuple[FieldPicture, ...]:
    """Return the scenes of a folder that have fields: the low and the high spring, and the fruit; raises InputError."""
    scenes: list[FieldPicture] = []
    if (folder / FLEXURE).is_file():
        half = read_mesh(folder / FLEXURE)
        if DISPLACEMENT in half.point_data and tip_face("low") in half.point_data:
            scenes += _flexure_scenes(report, whole_model(half))
    if (folder / FRUIT).is_file():
        block = read_mesh(folder / FRUIT)
        if DISPLACEMENT in block.point_data:
            scenes.append(_fruit_scene(report.design, block))
    return tuple(scenes)


def _flexure_scenes(report: Report, mesh: Mesh) -> list[FieldPicture]:
    """Return the housing on the side of each spring, cut midway between the tips."""
    data = mesh.point_data
    data[TOTAL_DISPLACEMENT.array] = np.linalg.norm(data[DISPLACEMENT], axis=1)
    data[STRAIN_OVER_LIMIT.array] = np.asarray(data[STRAIN]) / report.design.process.strain_limit
    node_x = np.asarray(mesh.points)[:, 0]
    cell_x = np.asarray(mesh.cell_centers().points)[:, 0]
    tip_x = {spring: node_x[np.asarray(data[tip_face(spring)]) == 1].mean() for spring in SPRINGS}
    middle = sum(tip_x.values()) / len(tip_x)
    scenes = []
    for spring, x in tip_x.items():
        same_side = (cell_x > middle) if x > middle else (cell_x < middle)
        scene = FieldPicture(
            name=f"flexure-{spring}",
            title=f"{report.design.name}: {spring} spring",
            mesh=mesh.extract_cells(np.flatnonzero(same_side)),
            fields=(VON_MISES, STRAIN_OVER_LIMIT, LARGEST_STRAIN, TOTAL_DISPLACEMENT),
            enlarged=True,
        )
        scenes.append(scene)
    return scenes


def whole_model(mesh: Mesh) -> Mesh:
    """Return the complete mesh [mm] with its arrays: a half model and its mirror image; others unchanged."""
    if SYMMETRY not in mesh.point_data:
        return mesh
    mirror = vtkReflectionFilter()
    mirror.SetInputData(mesh)
    mirror.SetPlaneToY()
    mirror.SetCenter(0.0)
    mirror.CopyInputOn()
    mirror.FlipAllInputArraysOn()  # vectors and symmetric tensors change the sign of components with one y
    mirror.Update()
    return pv.wrap(mirror.GetOutput()).clean()


def _fruit_scene(design: Design, block: Mesh) -> FieldPicture:
    """Return the fruit bent to its true shape and cut through a row of tips."""
    mesh = on_true_shape(design, block)
    mesh.point_data[TOTAL_DISPLACEMENT.array] = np.linalg.norm(mesh.point_data[DISPLACEMENT], axis=1)
    mesh.point_data[VERTICAL_PRESSURE.array] = -np.asarray(mesh.point_data[STRESS])[:, _ZZ]
    # The picture extends a little beyond the tips, is as deep as wide, and stays within the block. VTK's bounds
    # alternate: least x, largest x, least y, and so on.
    positions = np.array(design.tips.places_mm)
    first_x, row_y = positions.min(axis=0)  # the row of tips nearest to the viewer
    last_x, last_y = positions.max(axis=0)
    reach = _FOCUS * design.tips.spacing_mm
    depth = 0.5 * (last_x - first_x + reach)
    lower = np.maximum([first_x - reach, row_y, -depth], mesh.bounds[0::2])
    upper = np.minimum([last_x + reach, last_y + reach, mesh.bounds[5]], mesh.bounds[1::2])
    return FieldPicture(
        name="fruit",
        title=f"{design.name}: fruit under the tips, cut through a row of them",
        mesh=mesh,
        fields=(VERTICAL_PRESSURE, VON_MISES, LARGEST_STRAIN, TOTAL_DISPLACEMENT),
        direction=Vector(0.2, -1.0, 0.55),
        cut_y=float(row_y),
        focus=tuple(np.stack([lower, upper], axis=1).ravel().tolist()),
    )


def on_true_shape(design: Design, block: Mesh) -> Mesh:
    """Return the block of a fruit [mm] bent to the skin of a sphere or an ellipsoid, if the fruit is curved."""
    mesh = block.copy()
    if design.fruit.radius_mm is None:
        return mesh
    footprints = contact_footprints(design.fruit, design.tips)
    shape = CurvedShape(design.fruit, core_of(smooth_loads(design.fruit, footprints)))
    turned = np.array([1.0, 1.0, -1.0])  # z points down in the shape and up in the mesh
    mesh.points = shape.bend((np.asarray(block.points) * turned).T).T * turned
    return mesh


def assembly_parts(report: Report) -> list[cq.Assembly]:
    """Return every part of the sensor over its fruit [mm]; empty if the design has no housing."""
    return [] if report.housing is None else assembly_of(sensor_of(report.design, report.housing)).children


def draw_assembly(plotter: Plotter, parts: Sequence[cq.Assembly], title: str) -> None:
    """Draw parts in their colours and places."""
    surfaces = [_drawn(plotter, part) for part in parts]
    frame(plotter, pv.merge(surfaces), title, ASSEMBLY_DIRECTION)


def draw_apart(plotter: Plotter, parts: Sequence[cq.Assembly], title: str) -> None:
    """Draw an exploded view: parts move outwards across the sensor and the fruit down, with a leader to each name.

    It is seen from below, so that the tips show. The names of tips and fruit are below all parts, the others above.
    Each is a step beyond the one before, so that no name hides another.
    """
    surfaces = []
    starts: dict[str, Floats] = {}  # starts of the leaders to names above
    below: dict[str, Floats] = {}
    lowest: list[Floats] = []  # the lowest point of each part except the fruit
    for part in parts:
        kind = part.name.rstrip("0123456789_").replace("_", " ")
        is_fruit = kind == "fruit"
        down = _FRUIT_DOWN * in_place(part).BoundingBox().zlen if is_fruit else 0.0
        surface = _drawn(plotter, part, (0.0, outwards(part), -down))
        surfaces.append(surface)
        if is_fruit:
            below[kind] = _middle_at(surface, surface.bounds[4])
        else:
            starts.setdefault(kind, _middle_at(surface, surface.bounds[5]))
            lowest.append(min(np.asarray(surface.points), key=_height))
    lowest_z = min(map(_height, lowest))
    below["tip"] = next(point for point in lowest if _height(point) < lowest_z + _AS_LOW_MM)
    whole = pv.merge(surfaces)
    left, right, front, back, bottom, top = whole.bounds
    beside_fruit = below["tip"] - np.array([_TIP_ASIDE * (right - left), 0.0, 0.0])
    ends = {**_name_ends(whole, starts, 1.0), **_name_ends(whole, {**below, "tip": beside_fruit}, -1.0)}
    look: dict[str, object] = {"font_size": 18, "text_color": "black", "shape_color": "white"}
    for kind, end in ends.items():
        plotter.add_mesh(pv.Line({**starts, **below}[kind], end), color=EDGE, line_width=1)
        # VTK omits labels near to others if they are added together
        plotter.add_point_labels([end], [kind], always_visible=True, show_points=False, **look)
    heights = [bottom, top, *(float(end[2]) for end in ends.values())]
    frame(plotter, whole, title, _APART_DIRECTION, (left, right, front, back, min(heights), max(heights)))


def _height(point: Floats) -> float:
    return float(point[2])


def _middle_at(surface: Mesh, z: float) -> Floats:
    """Return the point at a height [mm] above or below the centre of a surface."""
    x, y, _ = surface.center
    return np.array([x, y, z])


def _name_ends(whole: Mesh, starts: Mapping[str, Floats], sign: float) -> dict[str, Floats]:
    """Return the positions of names above (`sign` 1) or below (-1) a body [mm] in the exploded view.

    Each is above or below its start, a step beyond the name before it.
    """
    left, right, front, back, bottom, top = whole.bounds
    # The upward direction in the picture, seen along `eye`; a level is the height of a point in it.
    eye = np.array(_APART_DIRECTION) / np.linalg.norm(_APART_DIRECTION)
    upwards = np.array([0.0, 0.0, 1.0]) - eye[2] * eye
    corners = itertools.product((left, right), (front, back), (top if sign > 0.0 else bottom,))
    level = max(sign * float(np.dot(corner, upwards)) for corner in corners)
    ends = {}
    for kind, (x, y, _) in starts.items():
        level += _LEADER * (top - bottom)
        ends[kind] = np.array([x, y, (sign * level - x * upwards[0] - y * upwards[1]) / upwards[2]])
    return ends


def _drawn(plotter: Plotter, part: cq.Assembly, moved_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Mesh:
    """Draw a part in its colour with its edges, moved by a vector [mm]; return its surface."""
    vertices, triangles = in_place(part).tessellate(_CHORD_MM, _FACET_ANGLE)
    points = np.array([vertex.toTuple() for vertex in vertices])
    surface = pv.PolyData.from_regular_faces(points, np.array(triangles)).clean()
    surface = surface.translate(moved_mm)
    plotter.add_mesh(surface, color=colour_of(part), smooth_shading=True, split_sharp_edges=True, ambient=0.2)
    plotter.add_mesh(sharp_edges(surface), color=EDGE, line_width=1)
    return surface
