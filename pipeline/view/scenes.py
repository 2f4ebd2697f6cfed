"""What can be drawn of an output folder: each spring, the fruit, the assembly."""

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv
from vtkmodules.vtkFiltersGeneral import vtkReflectionFilter

from cad.parts.assembly import assembly_bodies, outwards, sensor_of
from cad.parts.sensor import NamedSolid
from pipeline.report.report import Report
from pipeline.view.scene import DISPLACEMENT, EDGE, Field, FieldScene, Vector, frame, sharp_edges
from sensor.design.parameters import Design
from sensor.quantity import validation_error
from solve.fruit.bent_block import core_of
from solve.fruit.curved_shape import CurvedShape
from solve.fruit.smooth_load import smooth_loads
from solve.fruit.split import contact_footprints
from solve.housing.stiffness import SPRINGS, tip_face

Mesh = Any  # a PyVista data set: its decorated methods have no types that strict mode takes
Plotter = Any

FLEXURE = "flexure.vtu"
FRUIT = "fruit.vtu"
SYMMETRY = "symmetry"  # marks the nodes on the plane y = 0 of a half model
STRAIN = "largest_principal_strain"
STRESS = "stress_MPa"

VON_MISES = Field(array="von_mises_MPa", title="von Mises stress [MPa]")
TOTAL_DISPLACEMENT = Field(array="total_displacement_mm", title="displacement [mm]")
LARGEST_STRAIN = Field(array=STRAIN, title="largest principal strain [1]")
STRAIN_OVER_LIMIT = Field(array="strain_over_limit", title="strain / limit of the leaves [1]")
VERTICAL_PRESSURE = Field(array="vertical_pressure_MPa", title="pressure along the press [MPa]")

_ZZ = 2  # of xx, yy, zz, xy, yz, xz
_FOCUS = 0.4  # of the spacing of the tips: how far around them the picture of the fruit reaches
_CHORD_MM = 0.05
_FACET_ANGLE = 0.2  # rad
_LEADER = 0.13  # of the height of the picture: by how much each name stands above the one before
ASSEMBLY_DIRECTION = Vector(0.55, -1.0, 0.5)
_APART_DIRECTION = Vector(1.0, -0.9, 0.75)


def read_mesh(path: Path) -> Mesh:
    """Return the mesh of a file; raises InputError when it holds no cell."""
    data = pv.read(path)
    if not getattr(data, "n_cells", 0):
        bound = "a mesh with at least one cell"
        raise validation_error("file", str(path), "", bound, "write it again with pipeline run")
    return data


def field_scenes(report: Report, folder: Path) -> tuple[FieldScene, ...]:
    """Return the scenes of a folder that have fields: the low and the high spring, the fruit; raises InputError."""
    scenes: list[FieldScene] = []
    if (folder / FLEXURE).is_file():
        half = read_mesh(folder / FLEXURE)
        if DISPLACEMENT in half.point_data and tip_face("low") in half.point_data:
            scenes += _flexure_scenes(report, whole_model(half))
    if (folder / FRUIT).is_file():
        block = read_mesh(folder / FRUIT)
        if DISPLACEMENT in block.point_data:
            scenes.append(_fruit_scene(report.design, block))
    return tuple(scenes)


def _flexure_scenes(report: Report, mesh: Mesh) -> list[FieldScene]:
    """Return the housing on the side of each spring, cut off midway between the tips."""
    data = mesh.point_data
    data[TOTAL_DISPLACEMENT.array] = np.linalg.norm(data[DISPLACEMENT], axis=1)
    data[STRAIN_OVER_LIMIT.array] = np.asarray(data[STRAIN]) / report.leaves.made_of.strain_limit
    node_x = np.asarray(mesh.points)[:, 0]
    cell_x = np.asarray(mesh.cell_centers().points)[:, 0]
    tip_x = {spring: node_x[np.asarray(data[tip_face(spring)]) == 1].mean() for spring in SPRINGS}
    middle = sum(tip_x.values()) / len(tip_x)
    scenes = []
    for spring, x in tip_x.items():
        same_side = (cell_x > middle) if x > middle else (cell_x < middle)
        scene = FieldScene(
            name=f"flexure-{spring}",
            title=f"{report.design.name}: {spring} spring",
            mesh=mesh.extract_cells(np.flatnonzero(same_side)),
            fields=(VON_MISES, STRAIN_OVER_LIMIT, LARGEST_STRAIN, TOTAL_DISPLACEMENT),
            enlarged=True,
        )
        scenes.append(scene)
    return scenes


def whole_model(mesh: Mesh) -> Mesh:
    """Return the whole of a mesh [mm] with its arrays: a half model and its mirror image, anything else as it is."""
    if SYMMETRY not in mesh.point_data:
        return mesh
    mirror = vtkReflectionFilter()
    mirror.SetInputData(mesh)
    mirror.SetPlaneToY()
    mirror.SetCenter(0.0)
    mirror.CopyInputOn()
    mirror.FlipAllInputArraysOn()  # vectors and symmetric tensors change the sign of what has one y
    mirror.Update()
    return pv.wrap(mirror.GetOutput()).clean()


def _fruit_scene(design: Design, block: Mesh) -> FieldScene:
    """Return the fruit bent to its true shape and cut through a row of tips."""
    mesh = on_true_shape(design, block)
    mesh.point_data[TOTAL_DISPLACEMENT.array] = np.linalg.norm(mesh.point_data[DISPLACEMENT], axis=1)
    mesh.point_data[VERTICAL_PRESSURE.array] = -np.asarray(mesh.point_data[STRESS])[:, _ZZ]
    # The picture reaches a little around the tips, as deep as it is wide, and not beyond the block.
    positions = np.array(design.tips.places_mm)
    first_x, row_y = positions.min(axis=0)  # the row of tips nearest to the eye
    last_x, last_y = positions.max(axis=0)
    reach = _FOCUS * design.tips.spacing_mm
    depth = 0.5 * (last_x - first_x + reach)
    lower = np.maximum([first_x - reach, row_y, -depth], mesh.bounds[0::2])
    upper = np.minimum([last_x + reach, last_y + reach, mesh.bounds[5]], mesh.bounds[1::2])
    return FieldScene(
        name="fruit",
        title=f"{design.name}: fruit under the tips, cut through a row of them",
        mesh=mesh,
        fields=(VERTICAL_PRESSURE, VON_MISES, LARGEST_STRAIN, TOTAL_DISPLACEMENT),
        direction=Vector(0.2, -1.0, 0.55),
        cut_y=float(row_y),
        focus=tuple(np.stack([lower, upper], axis=1).ravel().tolist()),
    )


def on_true_shape(design: Design, block: Mesh) -> Mesh:
    """Return the block of a fruit [mm] bent to the fruit: a sphere's or an ellipsoid's skin where it has one."""
    mesh = block.copy()
    if design.fruit.radius_mm is None:
        return mesh
    footprints = contact_footprints(design.fruit, design.tips)
    shape = CurvedShape(design.fruit, core_of(smooth_loads(design.fruit, footprints)))
    turned = np.array([1.0, 1.0, -1.0])  # the shape has z downwards, the mesh upwards
    mesh.points = shape.bend((np.asarray(block.points) * turned).T).T * turned
    return mesh


def assembly(report: Report) -> tuple[NamedSolid, ...]:
    """Return every body of the sensor over its fruit [mm]; none where the design has no housing."""
    return () if report.housing is None else assembly_bodies(sensor_of(report.design, report.housing))


def draw_assembly(plotter: Plotter, bodies: tuple[NamedSolid, ...], title: str) -> None:
    """Draw bodies in their colours, where they are."""
    surfaces = [_drawn(plotter, body, 0.0) for body in bodies]
    frame(plotter, pv.merge(surfaces), title, ASSEMBLY_DIRECTION)


def draw_apart(plotter: Plotter, bodies: tuple[NamedSolid, ...], title: str) -> None:
    """Draw bodies moved outwards across the sensor, so that each shows; a line leads from each kind to its name.

    The names stand above all bodies, one a step higher than the next, so that none hides another.
    """
    surfaces = []
    first_of_kind: dict[str, Mesh] = {}
    for body in bodies:
        surface = _drawn(plotter, body, outwards(body))
        surfaces.append(surface)
        first_of_kind.setdefault(body.name.rstrip("0123456789 "), surface)
    whole = pv.merge(surfaces)
    left, right, front, back, bottom, top = whole.bounds
    # The direction that is up in the picture, seen along `eye`; a level is how high a point stands in it.
    eye = np.array(_APART_DIRECTION) / np.linalg.norm(_APART_DIRECTION)
    upwards = np.array([0.0, 0.0, 1.0]) - eye[2] * eye
    level = max(float(np.dot(corner, upwards)) for corner in itertools.product((left, right), (front, back), (top,)))
    highest = top
    for kind, surface in first_of_kind.items():
        level += _LEADER * (top - bottom)
        x, y, _ = surface.center
        end = np.array([x, y, (level - x * upwards[0] - y * upwards[1]) / upwards[2]])  # above the body, at the level
        highest = max(highest, float(end[2]))
        plotter.add_mesh(pv.Line((x, y, surface.bounds[5]), end), color=EDGE, line_width=1)
        look: dict[str, object] = {"font_size": 18, "text_color": "black", "shape_color": "white"}
        # of labels that are added together VTK leaves out those that are near to others
        plotter.add_point_labels([end], [kind], always_visible=True, show_points=False, **look)
    frame(plotter, whole, title, _APART_DIRECTION, (left, right, front, back, bottom, highest))


def _drawn(plotter: Plotter, body: NamedSolid, outwards_mm: float) -> Mesh:
    """Draw a body in its colour with its edges, moved outwards across the sensor [mm]; return its surface."""
    vertices, triangles = body.shape.tessellate(_CHORD_MM, _FACET_ANGLE)
    points = np.array([vertex.toTuple() for vertex in vertices])
    surface = pv.PolyData.from_regular_faces(points, np.array(triangles)).clean()
    surface = surface.translate((0.0, outwards_mm, 0.0))
    plotter.add_mesh(surface, color=body.colour, smooth_shading=True, split_sharp_edges=True, ambient=0.2)
    plotter.add_mesh(sharp_edges(surface), color=EDGE, line_width=1)
    return surface
