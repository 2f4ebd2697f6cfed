"""The scenes that can be drawn from an output folder: each spring, the fruit, and the assembly."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyvista as pv
from vtkmodules.vtkFiltersGeneral import vtkReflectionFilter

from cad.parts.assembly import assemble_sensor, draw_sensor, exploded_shift, part_colour, placed_shape
from pipeline.making.field_files import FLEXURE, FRUIT
from pipeline.report.report import Report
from pipeline.view.field_picture import DISPLACEMENT, EDGE, Field, FieldPicture, Vector, frame_picture, sharp_edges
from sensor.arrays import Floats
from sensor.design.parameters import Design
from sensor.quantity import validation_error
from solve.fruit.bent_block import enclosing_core
from solve.fruit.curved_shape import CurvedShape
from solve.fruit.smooth_load import smooth_loads
from solve.fruit.split import contact_footprints
from solve.housing.stiffness import SPRINGS, tip_face

if TYPE_CHECKING:
    import cadquery as cq

Mesh = Any  # a PyVista data set; its decorated methods have no types that mypy's strict mode accepts
Plotter = Any

SYMMETRY = "symmetry"  # array that marks the nodes of a half model on the plane y = 0
STRAIN = "largest_principal_strain"
STRESS = "stress_MPa"

VON_MISES = Field(array="von_mises_MPa", title="von Mises stress [MPa]")
TOTAL_DISPLACEMENT = Field(array="total_displacement_mm", title="displacement [mm]")
LARGEST_STRAIN = Field(array=STRAIN, title="largest principal strain [1]")
STRAIN_OVER_LIMIT = Field(array="strain_over_limit", title="strain / limit of the leaves [1]")
VERTICAL_PRESSURE = Field(array="vertical_pressure_MPa", title="pressure along the press [MPa]")

_ZZ = 2  # index of zz in the stress components xx, yy, zz, xy, yz, xz
_BEYOND_TIPS = 0.4  # distance by which the picture of the fruit extends beyond the tips, divided by their spacing
_CHORD_MM = 0.05  # largest distance between a triangle and the curved face that it replaces
_FACET_ANGLE_RAD = 0.2  # largest angle between neighbouring triangles of a curved face
_LABEL_STEP = 0.13  # difference in height between two labels, as a fraction of the height of the assembly
_LEADER_MARGIN = 1.1  # slope of the leader line of the tips, divided by the least one that clears the fruit
_MAX_LEADER_SLOPE = 2.0  # largest sideways extent of the leader line of the tips, divided by its height
_FRUIT_SHIFT = 1.2  # downward shift of the fruit in the exploded view, as a fraction of the height of the fruit
_SAME_HEIGHT_MM = 1e-3  # two tips are at the same height if their heights differ by less than this
ASSEMBLY_DIRECTION = Vector(0.55, -1.0, 0.5)
_EXPLODED_DIRECTION = Vector(0.7, -1.0, -0.35)  # a view from below, in which the tips are visible


def read_mesh(path: Path) -> Mesh:
    """Read a mesh from a file. Raises InputError if the mesh has no cells."""
    data = pv.read(path)
    if not getattr(data, "n_cells", 0):
        bound = "a mesh with at least one cell"
        raise validation_error("file", str(path), "", bound, "write it again with pipeline run")
    return data


def field_scenes(report: Report, folder: Path) -> tuple[FieldPicture, ...]:
    """Return the scenes for which a folder has fields: the low spring, the high spring, and the fruit.

    Raises InputError if a file has no mesh.
    """
    scenes: list[FieldPicture] = []
    # A run without --fields writes only a mesh. The scenes of the springs also need the marked nodes of the tip faces.
    if (folder / FLEXURE).is_file():
        half = read_mesh(folder / FLEXURE)
        if DISPLACEMENT in half.point_data and tip_face("low") in half.point_data:
            scenes += _flexure_scenes(report, complete_half_model(half))
    if (folder / FRUIT).is_file():
        block = read_mesh(folder / FRUIT)
        if DISPLACEMENT in block.point_data:
            scenes.append(_fruit_scene(report.design, block))
    return tuple(scenes)


def _flexure_scenes(report: Report, mesh: Mesh) -> list[FieldPicture]:
    """Return a scene for each spring: the part of the housing on its side of the plane midway between the tips.

    `mesh` is the whole housing [mm], with its fields at the nodes. Two arrays are added to it: the magnitude of the
    displacement, and the strain divided by its limit.
    """
    data = mesh.point_data
    data[TOTAL_DISPLACEMENT.array] = np.linalg.norm(data[DISPLACEMENT], axis=1)
    data[STRAIN_OVER_LIMIT.array] = np.asarray(data[STRAIN]) / report.design.process.strain_limit
    node_x = np.asarray(mesh.points)[:, 0]
    cell_x = np.asarray(mesh.cell_centers().points)[:, 0]
    tip_x = {}
    for spring in SPRINGS:
        is_on_tip = np.asarray(data[tip_face(spring)]) == 1  # the array is 1 at the nodes of the face, and 0 elsewhere
        tip_x[spring] = node_x[is_on_tip].mean()
    middle_x = sum(tip_x.values()) / len(tip_x)
    scenes = []
    for spring, x in tip_x.items():
        is_on_side = (cell_x > middle_x) if x > middle_x else (cell_x < middle_x)
        scene = FieldPicture(
            name=f"flexure-{spring}",
            title=f"{report.design.name}: {spring} spring",
            mesh=mesh.extract_cells(np.flatnonzero(is_on_side)),
            fields=(VON_MISES, STRAIN_OVER_LIMIT, LARGEST_STRAIN, TOTAL_DISPLACEMENT),
            enlarged=True,
        )
        scenes.append(scene)
    return scenes


def complete_half_model(mesh: Mesh) -> Mesh:
    """Return the mesh [mm] of a whole body, with its arrays.

    A half model is completed by its mirror image in the plane y = 0. Any other mesh is returned unchanged.
    """
    if SYMMETRY not in mesh.point_data:
        return mesh
    mirror = vtkReflectionFilter()
    mirror.SetInputData(mesh)
    mirror.SetPlaneToY()
    mirror.SetCenter(0.0)
    mirror.CopyInputOn()  # the result contains the given half too
    # A reflection in y changes the sign of each component of a vector or tensor that has exactly one index y.
    mirror.FlipAllInputArraysOn()
    mirror.Update()
    return pv.wrap(mirror.GetOutput()).clean()  # merges the nodes of both halves on the plane


def _fruit_scene(design: Design, block: Mesh) -> FieldPicture:
    """Return the scene of the fruit: its block, bent to the true shape of the fruit and cut through a row of tips.

    `block` is the mesh in which the fruit was solved [mm], with its fields at the nodes.
    """
    mesh = bend_to_true_shape(design, block)
    mesh.point_data[TOTAL_DISPLACEMENT.array] = np.linalg.norm(mesh.point_data[DISPLACEMENT], axis=1)
    mesh.point_data[VERTICAL_PRESSURE.array] = -np.asarray(mesh.point_data[STRESS])[:, _ZZ]  # positive in compression
    positions = np.array(design.tips.places_mm)  # x and y of each tip
    first_x, row_y = positions.min(axis=0)  # `row_y` is the row of tips nearest to the viewer
    last_x, last_y = positions.max(axis=0)
    # The picture extends a little beyond the tips, but not beyond the block. The top of the picture is the top of the
    # block.
    margin = _BEYOND_TIPS * design.tips.spacing_mm
    depth = 0.5 * (last_x - first_x + margin)  # below the top of the fruit at z = 0; about half the width
    block_lower = mesh.bounds[0::2]  # the bounds of VTK are minimum and maximum x, then y, then z
    block_upper = mesh.bounds[1::2]
    lower = np.maximum([first_x - margin, row_y, -depth], block_lower)
    upper = np.minimum([last_x + margin, last_y + margin, block_upper[2]], block_upper)
    return FieldPicture(
        name="fruit",
        title=f"{design.name}: fruit under the tips, cut through a row of them",
        mesh=mesh,
        fields=(VERTICAL_PRESSURE, VON_MISES, LARGEST_STRAIN, TOTAL_DISPLACEMENT),
        direction=Vector(0.2, -1.0, 0.55),
        cut_y=float(row_y),
        focus=tuple(np.stack([lower, upper], axis=1).ravel().tolist()),  # lower and upper x, then y, then z
    )


def bend_to_true_shape(design: Design, block: Mesh) -> Mesh:
    """Return the mesh of a fruit's block [mm], bent to the curved skin of the fruit.

    The solver maps a block to the curved fruit. This function applies the same map to the nodes. If the fruit is flat,
    the function returns an unchanged copy.
    """
    mesh = block.copy()
    if design.fruit.radius_mm is None:
        return mesh
    footprints = contact_footprints(design.fruit, design.tips)
    shape = CurvedShape(design.fruit, enclosing_core(smooth_loads(design.fruit, footprints)))
    flip_z = np.array([1.0, 1.0, -1.0])  # z points down in the shape and up in the mesh
    block_points = np.asarray(block.points) * flip_z  # (nodes, 3), while `bend` takes and returns (3, nodes)
    mesh.points = shape.bend(block_points.T).T * flip_z
    return mesh


def assembly_parts(report: Report) -> list[cq.Assembly]:
    """Return the parts of the assembly of a sensor above its fruit [mm], or an empty list if there is no housing."""
    return [] if report.housing is None else assemble_sensor(draw_sensor(report.design, report.housing)).children


def draw_assembly(plotter: Plotter, parts: Sequence[cq.Assembly], title: str) -> None:
    """Draw the parts of an assembly in their positions and colours."""
    surfaces = [_draw_part(plotter, part) for part in parts]
    frame_picture(plotter, pv.merge(surfaces), title, ASSEMBLY_DIRECTION)


def draw_exploded_view(plotter: Plotter, parts: Sequence[cq.Assembly], title: str) -> None:
    """Draw an exploded view of an assembly, with a label and a leader line for each kind of part.

    The view is from below, so that the tips are visible. The labels of the tip and the fruit are below all parts, and
    all other labels are above them.
    """
    # A leader line runs from its start at the part to its end at the label. The mappings are keyed by the part's name.
    surfaces, upper_starts, lower_starts = _draw_parts_apart(plotter, parts)
    fruit = next(surface for part, surface in zip(parts, surfaces, strict=True) if part.name == "fruit")
    all_parts = pv.merge(surfaces)
    left, right, front, back, bottom, top = all_parts.bounds
    starts = {**upper_starts, **lower_starts}
    ends = {
        **_label_positions(all_parts, upper_starts, side=1.0),
        **_label_positions(all_parts, lower_starts, side=-1.0),
    }
    ends["tip"] = _beside_fruit(starts["tip"], ends["tip"], fruit)
    style: dict[str, object] = {"font_size": 18, "text_color": "black", "shape_color": "white"}
    for part_name, end in ends.items():
        plotter.add_mesh(pv.Line(starts[part_name], end), color=EDGE, line_width=1)
        # If several labels were added in one call, VTK would omit labels that are close to others.
        plotter.add_point_labels([end], [part_name], always_visible=True, show_points=False, **style)
    heights = [bottom, top, *(float(end[2]) for end in ends.values())]
    left = min(left, float(ends["tip"][0]))
    bounds_with_labels = (left, right, front, back, min(heights), max(heights))
    frame_picture(plotter, all_parts, title, _EXPLODED_DIRECTION, bounds_with_labels)


def _draw_parts_apart(
    plotter: Plotter, parts: Sequence[cq.Assembly]
) -> tuple[list[Mesh], dict[str, Floats], dict[str, Floats]]:
    """Draw the parts of an assembly, moved apart across the sensor; only the fruit is moved down.

    Returns the surfaces of all parts, and two mappings from the name of a part to the starting point (3,) [mm] of its
    leader line. The lines of the first mapping lead to labels above the parts, and the lines of the second to labels
    below. Equal parts share one name and one leader line.
    """
    surfaces = []
    upper_starts: dict[str, Floats] = {}
    lower_starts: dict[str, Floats] = {}
    lowest_points: list[Floats] = []  # the lowest point of each part except the fruit
    for part in parts:
        part_name = part.name.rstrip("0123456789_").replace("_", " ")  # "screw" for screw_1
        is_fruit = part_name == "fruit"
        shift_down = _FRUIT_SHIFT * placed_shape(part).BoundingBox().zlen if is_fruit else 0.0
        surface = _draw_part(plotter, part, (0.0, exploded_shift(part), -shift_down))
        surfaces.append(surface)
        *_, lowest_z, highest_z = surface.bounds
        if is_fruit:
            lower_starts[part_name] = _centre_at_height(surface, lowest_z)
        else:
            start = _centre_at_height(surface, highest_z)
            # The view is from the right, so the upper right one of equal parts is in front of no larger part.
            earlier_start = upper_starts.get(part_name)
            if earlier_start is None or start[0] + start[2] > earlier_start[0] + earlier_start[2]:
                upper_starts[part_name] = start
            lowest_points.append(min(np.asarray(surface.points), key=_height))
    lower_starts["tip"] = _first_tip(lowest_points)
    return surfaces, upper_starts, lower_starts


def _first_tip(lowest_points: Sequence[Floats]) -> Floats:
    """Return the end (3,) [mm] of the first tip, from the lowest point of each part of the sensor.

    A tip is not a separate part, but the tips are the lowest points of the sensor.
    """
    tip_z = min(map(_height, lowest_points))
    return next(point for point in lowest_points if _height(point) < tip_z + _SAME_HEIGHT_MM)


def _height(point: Floats) -> float:
    """Return the z coordinate of a point (3,)."""
    return float(point[2])


def _centre_at_height(surface: Mesh, z: float) -> Floats:
    """Return the point at the height `z` [mm] that is directly above or below the centre of a surface."""
    x, y, _ = surface.center
    return np.array([x, y, z])


def _label_positions(all_parts: Mesh, starts: Mapping[str, Floats], *, side: float) -> dict[str, Floats]:
    """Return the positions [mm] of labels in the exploded view: above the assembly if `side` is 1, below it if -1.

    `all_parts` is the mesh of the assembly, and `starts` are the starting points (3,) [mm] of the leader lines, keyed
    by the name of the part. Each label is directly above or below the start of its leader line. In the picture, each
    label is a step farther from the assembly than the previous one, so that no label hides another.
    """
    left, right, front, back, bottom, top = all_parts.bounds
    # The vertical direction of the picture is z, projected onto the picture plane. The level of a point is the
    # coordinate along this direction, multiplied by `side`, so that it increases away from the assembly.
    view = np.array(_EXPLODED_DIRECTION) / np.linalg.norm(_EXPLODED_DIRECTION)
    upwards = np.array([0.0, 0.0, 1.0]) - view[2] * view
    outer_z = top if side > 0.0 else bottom
    corners = itertools.product((left, right), (front, back), (outer_z,))
    level = max(side * float(np.dot(corner, upwards)) for corner in corners)
    positions = {}
    for part_name, (x, y, _) in starts.items():
        level += _LABEL_STEP * (top - bottom)
        # The level of a position (x, y, z) is the dot product side (x, y, z) . upwards. This equation is solved for z.
        z = (side * level - x * upwards[0] - y * upwards[1]) / upwards[2]
        positions[part_name] = np.array([x, y, z])
    return positions


def _beside_fruit(start: Floats, end: Floats, fruit: Mesh) -> Floats:
    """Move the end of a leader line [mm] to the left, so that the line from `start` passes left of the fruit.

    In the picture, the end stays at its height. Its slope is limited, so the line may still run behind a wide fruit.
    """
    right, upwards = _picture_axes()
    points = np.asarray(fruit.points)
    to_left = (start - points) @ right  # distance from each point of the fruit to the start, in the picture
    drops = (start - points) @ upwards
    is_below = drops > 0.0
    least_slope = max(0.0, *(to_left[is_below] / drops[is_below]))  # to the left, divided by downwards
    slope = min(_MAX_LEADER_SLOPE, _LEADER_MARGIN * least_slope)
    shift = slope * float((start - end) @ upwards) - float((start - end) @ right)
    moved_end: Floats = end - max(0.0, shift) * right
    return moved_end


def _picture_axes() -> tuple[Floats, Floats]:
    """Return the directions to the right and upwards in the picture of the exploded view, as unit vectors (3,)."""
    view = np.array(_EXPLODED_DIRECTION) / np.linalg.norm(_EXPLODED_DIRECTION)
    right = np.cross([0.0, 0.0, 1.0], view)
    right /= np.linalg.norm(right)
    return right, np.cross(view, right)


def _draw_part(plotter: Plotter, part: cq.Assembly, shift_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Mesh:
    """Draw a part in its colour and with its edges, moved by the vector `shift_mm`, and return its surface."""
    vertices, triangles = placed_shape(part).tessellate(_CHORD_MM, _FACET_ANGLE_RAD)
    points = np.array([vertex.toTuple() for vertex in vertices])
    surface = pv.PolyData.from_regular_faces(points, np.array(triangles)).clean()
    surface = surface.translate(shift_mm)
    plotter.add_mesh(surface, color=part_colour(part), smooth_shading=True, split_sharp_edges=True, ambient=0.2)
    plotter.add_mesh(sharp_edges(surface), color=EDGE, line_width=1)
    return surface
