"""Read a solid that the user made, check that it is one part, identify its faces, and describe it as an extrusion."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cadquery as cq
import numpy as np
import OCP

from cad.checks.line_probe import crossings_of
from cad.checks.triangle_checks import LONGEST_MM, SHORTEST_MM
from cad.files.step import read_step
from cad.parts.housing import Housing
from cad.parts.part import Part, plane_face_test
from sensor.arrays import Flags, Floats
from sensor.quantity import InputError, validation_error

Place = tuple[float, float, float]
_Segment = tuple[tuple[float, float], tuple[float, float]]  # the ends ((x, z), (x, z)) of a line in the section [mm]

_INCH_MM = 25.4
_SIZE_TOLERANCE = 0.1  # relative tolerance of the length ratio by which a part in inches is recognised
_ON_FACE_MM = 0.05  # a point this close to a face lies on it; also the limit of geometry.as_designed for other programs
_ANGLE_TOLERANCE = 1e-4  # a unit normal is perpendicular to an axis if its component along the axis is below this
_MIN_SWEPT_FRACTION = 0.8  # smallest fraction of the surface area that is parallel or perpendicular to the sweep
_SAMPLES = (0.1, 0.5, 0.9)  # surface parameters at which a normal is evaluated, as fractions of their range
_NEAR_MM = 1e-5  # geometric tolerance: points closer than this are treated as one point
_MIN_MEAN_NORMAL = 0.5  # smallest length of the mean unit normal of faces that can be pressed; a closed ring has 0
_WALL_POINTS = 3000  # approximate number of points on a part at which its wall thickness is measured
_STEP_MM = 1e-3  # distance below the surface at which a ray into the material starts
_THINNEST_LAYER_MM = 1e-3  # thickness up to which a layer between two levels of a part is not cut
_CORNER_FRACTION = 0.25  # element size at a cylindrical face, as a fraction of half its circumference
_CHORD_MM, _ANGLE_RAD = 0.01, 0.3  # largest deviations of triangles from their face
_OUTSIDE_MM2 = 0.01  # largest area of another section that may lie outside the swept section
_OFF_CENTRE = 1e-3  # largest distance of the centroid of a face from mid-depth, as a fraction of the depth
_PIECE_MM = 0.5  # size of the pieces of a face at which the depths of part and mesh are compared
_MARGIN_MM = 1.0  # distance by which rays and cutting planes extend beyond the part
_KERNEL_TOLERANCE_MM = 1e-7  # tolerance of the CAD kernel for the crossing of a line and a face


def require_one_solid(
    shape: cq.Shape, name: str, housing: Housing | None = None, *, any_size: bool = False
) -> cq.Solid:
    """Check that a shape consists of exactly one valid, closed solid, and return this solid [mm].

    In error messages, `name` is the name of the file or the part. If `housing` is given, a part that was exported in
    inches is recognised by its length. `any_size` skips the size check, for calls before the housing is known. Raises
    InputError if the number of solids is not one, or if there are faces outside the solid. InputError is also raised
    if the CAD kernel OCCT finds the solid invalid, or if its size is wrong.
    """
    solid = _find_only_solid(shape, name)
    if not OCP.BRepCheck.BRepCheck_Analyzer(solid.wrapped).IsValid() or not solid.Volume() > 0.0:
        bound = "a closed solid that OCCT finds valid"
        raise validation_error("PART", name, "", bound, "repair it in the program that made it, and export it again")
    if not any_size:
        _check_size(solid, name, housing)
    return solid


def _find_only_solid(shape: cq.Shape, name: str) -> cq.Solid:
    """Return the only solid of a shape. Raises InputError if it has no or several solids, or faces outside the solid.

    In error messages, `name` is the name of the file or the part.
    """
    solids = shape.Solids()
    if not solids:
        bound = f"one closed solid: its {len(shape.Faces())} faces do not enclose a volume"
        raise validation_error("PART", name, "", bound, "close its surface and export the solid")
    if len(solids) > 1:
        bodies = "; ".join(_volume_and_centre(solid) for solid in solids[:3])  # only three, to keep the message short
        bound = f"one body: it has {len(solids)} bodies, {bodies}"
        raise validation_error("PART", name, "", bound, "join them, or export the part that is printed")
    unattached = len(shape.Faces()) - len(solids[0].Faces())
    if unattached:
        bound = f"one closed solid: {unattached} faces do not belong to it"
        raise validation_error("PART", name, "", bound, "export the solid without these faces")
    return solids[0]


def _volume_and_centre(solid: cq.Solid) -> str:
    """Return the volume and the centre of mass of a solid as text."""
    x, y, z = solid.Center().toTuple()
    return f"{solid.Volume():.4g} mm^3 at ({x:.4g}, {y:.4g}, {z:.4g}) mm"


def _check_size(solid: cq.Solid, name: str, housing: Housing | None) -> None:
    """Raise InputError if a solid is too small or too large for a part in millimetres.

    A solid that is 25.4 times smaller or larger than `housing` is refused too, because its unit was converted wrongly.
    In error messages, `name` is the name of the file or the part.
    """
    box = solid.BoundingBox()
    longest = max(box.xlen, box.ylen, box.zlen)
    size = f"{box.xlen:.4g} x {box.ylen:.4g} x {box.zlen:.4g} mm"
    if housing is not None:
        _reject_inches((housing.right - housing.left) / longest, name, size)
    if not SHORTEST_MM <= longest <= LONGEST_MM:
        bound = f"{SHORTEST_MM:g} to {LONGEST_MM:g} mm long: it is {size}"
        raise validation_error("PART", name, "", bound, "export it in millimetres, and one part only")


def _reject_inches(ratio: float, name: str, size: str) -> None:
    """Raise InputError if the size of a solid shows that it is in inches, or was converted from inches twice.

    `ratio` [1] is the length of the design divided by the length of the solid. In the error message, `name` is the name
    of the file or the part, and `size` is its size.
    """
    mistakes = (
        (_INCH_MM, "smaller", "in inches"),
        (1.0 / _INCH_MM, "larger", "converted from inches twice"),
    )
    for factor, comparison, mistake in mistakes:
        if abs(ratio / factor - 1.0) < _SIZE_TOLERANCE:
            bound = f"in millimetres: at {size} it is {_INCH_MM:g} times {comparison} than the design, as if {mistake}"
            raise validation_error("PART", name, "", bound, "export it in millimetres")


def read_own_solid(path: Path, housing: Housing | None = None, *, any_size: bool = False) -> cq.Solid:
    """Read the only solid [mm] of a STEP file.

    `housing` and `any_size` are passed to `require_one_solid`. Raises InputError if the file cannot be read, or if it
    does not hold exactly one valid solid.
    """
    try:
        shape = read_step(path)
    except ValueError as error:
        raise InputError(str(error)) from error
    return require_one_solid(shape, path.name, housing, any_size=any_size)


def faces_at(solid: cq.Solid, flag: str, points: Sequence[Place]) -> tuple[int, ...]:
    """Return the indices in `solid.Faces()` of the faces on which the points [mm] lie, each index once.

    A point lies on a face if it is at most 0.05 mm away from it. If a point lies on a cylindrical wall that is divided
    into several faces, the indices of all these faces are returned. In error messages, `flag` names the command-line
    flag that holds the points. Raises InputError if a point is not on a face, or if it is on an edge.
    """
    faces = solid.Faces()
    indices: list[int] = []
    for point in points:
        vertex = cq.Vertex.makeVertex(*point)
        distances = [face.distance(vertex) for face in faces]
        nearest = int(np.argmin(distances))
        if not distances[nearest] <= _ON_FACE_MM:  # also true if the distance is NaN
            point_text = ",".join(f"{value:g}" for value in point)
            bound = f"within {_ON_FACE_MM:g} mm of a face: the nearest is {distances[nearest]:.3g} mm away"
            raise validation_error(
                flag, point_text, "mm", bound, "give a point on the face, in the coordinates of the file"
            )
        wall = _faces_of_wall(faces, nearest)
        _reject_edge(faces, distances, wall, flag, point)
        indices += wall
    return tuple(dict.fromkeys(indices))  # without repetitions, in the order of the points


def _reject_edge(
    faces: Sequence[cq.Face], distances: Sequence[float], wall: Sequence[int], flag: str, point: Place
) -> None:
    """Raise InputError if `point` [mm] lies on an edge where a wall meets a face at an angle.

    `wall` holds the indices of the faces of the wall. `distances` [mm] are the distances of all `faces` from the point.
    In the error message, `flag` names the command-line flag that holds the point.
    """
    location = cq.Vector(*point)
    for index, face in enumerate(faces):
        # Only faces as close as the nearest face meet at the point. Edges between faces of the wall are accepted.
        if index in wall or distances[index] > min(distances) + _NEAR_MM:
            continue
        # A face that continues the wall smoothly is accepted, because a press has the same direction on both.
        if abs(face.normalAt(location).dot(faces[wall[0]].normalAt(location))) < 1.0 - _ANGLE_TOLERANCE:
            point_text = ",".join(f"{value:g}" for value in point)
            bound = "on one face: it lies on the edge between two faces"
            raise validation_error(flag, point_text, "mm", bound, "give a point inside the face")


def _faces_of_wall(faces: Sequence[cq.Face], index: int) -> list[int]:
    """Return the indices of the faces that touch a face and lie on the same cylinder, including the face itself.

    CAD programs often divide one cylindrical wall into several faces. `index` is the index of the face in `faces`. If
    the face is not cylindrical, only this index is returned.
    """
    cylinder = _cylinder_parameters(faces[index])
    if cylinder is None:
        return [index]
    wall = []
    for other_index, face in enumerate(faces):
        other_cylinder = _cylinder_parameters(face)
        if other_cylinder is None:
            continue
        is_same_cylinder = np.allclose(cylinder, other_cylinder, atol=_NEAR_MM)
        if is_same_cylinder and face.distance(faces[index]) < _NEAR_MM:
            wall.append(other_index)
    return wall


def _cylinder_parameters(face: cq.Face) -> Floats | None:
    """Return the radius, the axis direction and the axis foot of a cylindrical face as one vector, shape (7,).

    The radius and the foot are in mm. The foot is the point of the axis nearest to the origin. The direction is chosen
    so that its largest component is positive, because equal cylinders must have equal parameters. For any other face,
    None is returned.
    """
    if face.geomType() != "CYLINDER":
        return None
    cylinder = OCP.BRepAdaptor.BRepAdaptor_Surface(face.wrapped).Cylinder()
    axis = cylinder.Axis()
    direction = np.array([axis.Direction().X(), axis.Direction().Y(), axis.Direction().Z()])
    direction *= np.sign(direction[np.argmax(np.abs(direction))])
    # OCCT may return any point of the axis. Removing the component along the axis leaves the foot.
    point = np.array([axis.Location().X(), axis.Location().Y(), axis.Location().Z()])
    foot = point - (point @ direction) * direction
    return np.concatenate([[cylinder.Radius()], direction, foot])


def tagged_faces(workplane: object, solid: cq.Solid, flag: str, tag: str) -> tuple[int, ...]:
    """Return the indices in `solid.Faces()` of the faces that have a tag in a CadQuery workplane.

    An object that is not a workplane has no tags. In error messages, `flag` names the argument that held the tag.
    Raises InputError if there is no such tag, or if none of the tagged faces is a face of the solid.
    """
    tags = workplane.ctx.tags if isinstance(workplane, cq.Workplane) else {}
    if tag not in tags:
        names = ", ".join(tags) or "none"
        raise validation_error(
            flag, tag, "", f"a tag of the workplane, whose tags are: {names}", "tag the face, or give a point"
        )
    faces_with_tag: list[cq.Face] = []
    for value in tags[tag].vals():
        if isinstance(value, cq.Shape):
            faces_with_tag += value.Faces()
    # A tagged face may have been cut away later, so only the faces that the solid still has are returned.
    faces = solid.Faces()
    indices = [index for index, face in enumerate(faces) if any(face.isSame(tagged) for tagged in faces_with_tag)]
    if not indices:
        bound = "a tag of faces that the finished part still has"
        raise validation_error(flag, tag, "", bound, "tag the faces of the finished part")
    return tuple(indices)


def press_direction(solid: cq.Solid, flag: str, indices: Sequence[int]) -> Place:
    """Return the direction in which a press acts on faces: the unit vector opposite to their mean outer normal.

    `indices` are the indices of the faces in `solid.Faces()`. In the error message, `flag` names the command-line flag
    that selected the faces. Raises InputError if the mean normal is shorter than 0.5, because the normals cancel as on
    a closed ring.
    """
    faces = solid.Faces()
    area_vector = np.zeros(3)  # sum of area times mean outer normal [mm^2]
    area = 0.0
    for index in indices:
        face = faces[index]
        mean_normal = _FaceNormals(face).normals.mean(axis=0)
        # The normals belong to the surface of the face. If the face is reversed, they point into the solid.
        is_reversed = face.wrapped.Orientation() == OCP.TopAbs.TopAbs_REVERSED
        outer_normal = -mean_normal if is_reversed else mean_normal
        area_vector += face.Area() * outer_normal
        area += face.Area()
    # For a plane face, the length of the area vector equals the area. For a closed ring, the area vector is zero.
    resultant = float(np.linalg.norm(area_vector))
    if not resultant > _MIN_MEAN_NORMAL * area:
        bound = "faces whose normals have a common direction"
        raise validation_error(flag, "a closed ring of faces", "", bound, "press a plane face or a dome")
    # Rounding makes a direction along an axis exact. Adding 0.0 replaces -0.0 by 0.0.
    x, y, z = np.round(-area_vector / resultant, 9) + 0.0
    return float(x), float(y), float(z)


def combine_shapes(solid: object) -> cq.Shape:
    """Return a CadQuery shape unchanged, or the shapes on a workplane as one shape.

    Several shapes on a workplane become one compound. `solid` is what the user passed, so it may have any type. Raises
    InputError if it is neither a shape nor a workplane.
    """
    if isinstance(solid, cq.Shape):
        return solid
    if not isinstance(solid, cq.Workplane):
        bound = "a CadQuery workplane or shape"
        raise validation_error(
            "PART", type(solid).__name__, "", bound, "pass the shape of one part, not an assembly or a path"
        )
    shapes = [value for value in solid.vals() if isinstance(value, cq.Shape)]
    return shapes[0] if len(shapes) == 1 else cq.Compound.makeCompound(shapes)


def fill_round_tips(solid: cq.Solid, points: Iterable[Place]) -> cq.Solid:
    """Return a solid in which each spherical tip is filled up to a square bar, which ends in the tangent plane.

    The mesh of a housing has such square tips. `points` [mm] are the points at which the tips first touch the fruit.
    Points on faces that are not spherical are ignored. The filling changes the compliance 1 / K_h of the high spring by
    less than 5e-4 (tests/cad/parts/test_domes.py).
    """
    shape: cq.Shape = solid
    for point in points:
        contact = cq.Vertex.makeVertex(*point)
        face = min(solid.Faces(), key=lambda candidate: candidate.distance(contact))
        if face.geomType() == "SPHERE" and face.distance(contact) <= _ON_FACE_MM:
            box = face.BoundingBox()
            # The bar fills the bounding box of the spherical face.
            corner = cq.Vector(box.xmin, box.ymin, box.zmin)
            shape = shape.fuse(cq.Solid.makeBox(box.xlen, box.ylen, box.zlen, corner))
    # If a tip was filled, cleaning merges the faces of its bar with the faces of the solid in the same planes.
    return solid if shape is solid else shape.clean().Solids()[0]


def tip_points(housing: Housing) -> dict[str, Place]:
    """Return the point [mm] at which each tip of a housing first touches the fruit, keyed by spring name."""
    return {arm.name: (arm.centre, 0.0, 0.0) for arm in housing.arms}


def hole_points(housing: Housing) -> tuple[Place, ...]:
    """Return a point [mm] on the wall of each screw hole of a housing, at mid-depth."""
    return tuple((x + 0.5 * housing.hole_diameter, 0.0, z) for x, z in housing.holes)


def _distinct_crossings(intersector: OCP.IntCurvesFace.IntCurvesFace_ShapeIntersector) -> list[float]:
    """Return the distances [mm] from the start of a line at which it crosses the surface of a part, in ascending order.

    The intersector has already computed the crossings. A line through the edge between two faces crosses both faces at
    one point, which is returned once.
    """
    distances = sorted(crossings_of(intersector))
    # A crossing is dropped if another one follows it closely. None follows the last crossing.
    followed = itertools.pairwise([*distances, math.inf])
    return [distance for distance, following in followed if following - distance > _NEAR_MM]


@dataclass(frozen=True, kw_only=True, eq=False)
class Extrusion:
    """A part described as one section that is swept along y.

    `part` is the part in the coordinates of the sweep. `rotation` (3, 3) maps the coordinates of the original part to
    the coordinates of the sweep. `lines` holds the straight edges of slanted faces, projected onto the section:
    ((x, z), (x, z)) [mm]. The sweep extends from y = `low` to y = `high` [mm]. The section was cut at y = `plane` [mm].
    """

    part: Part
    rotation: Floats
    section: cq.Face
    lines: tuple[_Segment, ...]
    low: float
    high: float
    plane: float

    def material_spans(self, x: Floats, z: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the smallest and the largest y of the part on lines along y, and the material length, each (n,) [mm].

        The material length is the length of a line inside the material. `x` and `z` (n,) [mm] are the positions of the
        lines. If a line misses the part, the length is 0, and both values of y are below the part.
        """
        intersector = OCP.IntCurvesFace.IntCurvesFace_ShapeIntersector()
        intersector.Load(self.part.shape.wrapped, _KERNEL_TOLERANCE_MM)
        y_direction = OCP.gp.gp_Dir(0.0, 1.0, 0.0)
        box = self.part.shape.BoundingBox()
        # Each line starts below the part and ends above it.
        start, ray_length = box.ymin - _MARGIN_MM, box.ylen + 2.0 * _MARGIN_MM
        lowest, highest, lengths = np.zeros(len(x)), np.zeros(len(x)), np.zeros(len(x))
        for i, (line_x, line_z) in enumerate(zip(x.tolist(), z.tolist(), strict=True)):
            line = OCP.gp.gp_Lin(OCP.gp.gp_Pnt(line_x, start, line_z), y_direction)
            intersector.Perform(line, 0.0, ray_length)
            crossings = _distinct_crossings(intersector)
            if len(crossings) > 1:
                lowest[i], highest[i] = crossings[0], crossings[-1]
                # Entries into the material and exits from it alternate. A last entry without an exit is ignored.
                entries, exits = crossings[::2], crossings[1::2]
                lengths[i] = sum(leave - enter for enter, leave in zip(entries, exits, strict=False))
        return lowest + start, highest + start, lengths

    def feature_pieces(self) -> Iterator[tuple[Floats, float, float]]:
        """Yield small pieces of the faces at which the part is shallower or deeper than the sweep.

        Such faces are the bottoms of pockets, the tops of ribs, and slanted faces. Each piece is described by its
        position (x, z) [mm], its area projected along y [mm^2] and the mean width of its face [mm]. The faces are taken
        from the solid, because a narrow feature such as a saw cut may lie between the lines of any grid.
        """
        y_axis = np.array([0.0, 1.0, 0.0])
        for face in self.part.shape.Faces():
            face_normals = _FaceNormals(face)
            _, middle_y, _ = face_normals.middle
            to_nearer_end = min(abs(middle_y - end) for end in (self.low, self.high))
            is_end_of_sweep = face_normals.is_cap(y_axis) and to_nearer_end < _NEAR_MM
            if is_end_of_sweep or face_normals.is_side(y_axis):
                continue
            # The components 0 and 2 of the centroid of a piece are its x and z.
            pieces = [(middle[[0, 2]], area) for middle, area in _pieces_along_y(face) if area > _NEAR_MM**2]
            # The mean width is the area of the face divided by the diagonal of its bounding box, both seen along y.
            box = face.BoundingBox()
            width = sum(area for _, area in pieces) / math.hypot(box.xlen, box.zlen)
            yield from ((middle, area, width) for middle, area in pieces)

    def has_centred_faces(self, name: str) -> bool:
        """Return whether the centroid of the faces with this name is at mid-depth, within 0.1 % of the depth."""
        all_faces = self.part.shape.Faces()
        faces = [all_faces[index] for index in self.part.faces[name]]
        # The first moment of area [mm^3] about mid-depth is the area times the distance of the centroid.
        moment = sum(face.Area() * (face.Center().y - 0.5 * (self.low + self.high)) for face in faces)
        return abs(moment) < _OFF_CENTRE * (self.high - self.low) * sum(face.Area() for face in faces)

    def polygon_area(self, name: str) -> float | None:
        """Return the area [mm^2] of the faces with this name, or None if a face is curved or has a curved edge."""
        all_faces = self.part.shape.Faces()
        faces = [all_faces[index] for index in self.part.faces[name]]
        is_straight = all(
            face.geomType() == "PLANE" and all(edge.geomType() == "LINE" for edge in face.Edges()) for face in faces
        )
        return sum(face.Area() for face in faces) if is_straight else None

    def are_on_face(self, name: str, points: Floats, tolerance: float) -> Flags:
        """Return whether each point (3, n) [mm] lies within `tolerance` [mm] of a face with this name, shape (n,).

        Distances to a face are slow to compute, so only points inside its bounding box are measured.
        """
        is_on_face = np.zeros(points.shape[1], dtype=bool)
        all_faces = self.part.shape.Faces()
        for face_index in self.part.faces[name]:
            face = all_faces[face_index]
            box = face.BoundingBox()
            lowest = np.array([[box.xmin], [box.ymin], [box.zmin]]) - tolerance
            highest = np.array([[box.xmax], [box.ymax], [box.zmax]]) + tolerance
            is_in_box = ((points >= lowest) & (points <= highest)).all(axis=0)
            for index in np.flatnonzero(is_in_box & ~is_on_face):
                vertex = cq.Vertex.makeVertex(*points[:, index].tolist())
                is_on_face[index] = face.distance(vertex) <= tolerance
        return is_on_face


def find_extrusion(part: Part) -> Extrusion | None:
    """Return a part as a section that is swept along y, or None if the part is not such an extrusion.

    The normals of all plane faces are candidates for the direction of the sweep. The best candidate is the direction
    whose sweep has sides and ends that cover the largest fraction of the surface. The part is then rotated, so that
    this direction becomes the y axis. A part is not an extrusion if this fraction is below 80 %, if its largest section
    is in pieces, or if another section has material outside it.
    """
    faces = [_FaceNormals(face) for face in part.shape.Faces()]
    direction = max(_plane_normals(faces), key=lambda axis: _swept_fractions(faces, axis), default=None)
    if direction is None:  # the part has no plane face
        return None
    swept_fraction, _ = _swept_fractions(faces, direction)
    if swept_fraction < _MIN_SWEPT_FRACTION:
        return None
    rotation = _rotation_to_y(direction)
    rotated = part
    if not np.allclose(rotation, np.eye(3)):
        rotated = replace(part, shape=part.shape.moved(_rotation_location(rotation)))
    return _extrude_largest_section(rotated, rotation)


class _FaceNormals:
    """The area [mm^2], the centroid [mm], and up to nine unit normals (n, 3) of a face.

    The normals belong to the surface of the face, so they point into the solid if the face is reversed.
    """

    def __init__(self, face: cq.Face) -> None:
        """Evaluate the normals on a grid of three by three surface parameters."""
        self.area = float(face.Area())
        self.middle = np.array(face.Center().toTuple())
        u_min, u_max, v_min, v_max = face._uvBounds()  # the ranges of the two surface parameters
        surface = OCP.BRepAdaptor.BRepAdaptor_Surface(face.wrapped)
        normals = []
        for u_fraction, v_fraction in itertools.product(_SAMPLES, _SAMPLES):
            u, v = u_min + u_fraction * (u_max - u_min), v_min + v_fraction * (v_max - v_min)
            # The argument 1 requests first derivatives, from which the normal follows. OCCT leaves the normal undefined
            # if they are smaller than 1e-9.
            local_properties = OCP.BRepLProp.BRepLProp_SLProps(surface, u, v, 1, 1e-9)
            if local_properties.IsNormalDefined():
                normal = local_properties.Normal()
                normals.append((normal.X(), normal.Y(), normal.Z()))
        # The normal is undefined at a singular point, such as the apex of a cone. If the normal is undefined at all
        # points, a zero vector replaces it. The face is then a side of every sweep, and defines no direction of a
        # sweep.
        self.normals = np.array(normals or [(0.0, 0.0, 0.0)])

    def is_cap(self, direction: Floats) -> bool:
        """Return whether the face is perpendicular to a unit vector, like the end of a sweep along it."""
        # The cosine of a small angle differs from 1 by half the square of the angle.
        return bool((np.abs(self.normals @ direction) > 1.0 - _ANGLE_TOLERANCE**2).all())

    def is_side(self, direction: Floats) -> bool:
        """Return whether the face is parallel to a unit vector, like the side of a sweep along it."""
        return bool((np.abs(self.normals @ direction) < _ANGLE_TOLERANCE).all())


def _plane_normals(faces: Sequence[_FaceNormals]) -> Iterator[Floats]:
    """Yield the unit normals of the plane faces, each direction once, from the largest face to the smallest.

    Normals are rounded to nine decimals, so that a normal along a coordinate axis is exact.
    """
    earlier_normals: list[Floats] = []
    for face in sorted(faces, key=lambda face: -face.area):
        face_normal = face.normals[0]  # on a plane face, all normals are equal
        is_plane = np.allclose(face.normals, face_normal, atol=_ANGLE_TOLERANCE)
        is_defined = face_normal.any()  # a face whose normal is undefined everywhere has a zero vector instead
        if not is_plane or not is_defined:
            continue
        # Opposite normals give the same direction, because their largest component is made positive.
        sign = np.sign(face_normal[np.argmax(np.abs(face_normal))])
        normal = np.round(face_normal * sign, 9) + 0.0  # adding 0.0 replaces -0.0 by 0.0
        if all(abs(normal @ earlier) < 1.0 - _ANGLE_TOLERANCE**2 for earlier in earlier_normals):
            earlier_normals.append(normal)
            yield normal


def _swept_fractions(faces: Sequence[_FaceNormals], direction: Floats) -> tuple[float, float]:
    """Return the fractions of the surface area [1] that are covered by sides and ends of a sweep, and by ends only.

    `direction` is the unit vector of the sweep, and `faces` are all faces of the part. The ends are the faces
    perpendicular to the direction, at the two levels where such faces have the largest area. The second fraction
    decides between directions whose first fractions are equal. Both fractions are rounded to three decimals, so that
    round-off does not decide between equally good directions.
    """
    total_area = sum(face.area for face in faces)
    cap_areas: dict[float, float] = {}  # area of the perpendicular faces [mm^2], keyed by their level [mm]
    for face in faces:
        if face.is_cap(direction):
            level = round(float(face.middle @ direction), 4)  # levels that differ only by round-off become equal
            cap_areas[level] = cap_areas.get(level, 0.0) + face.area
    end_area = sum(sorted(cap_areas.values())[-2:])  # the two largest areas
    side_area = sum(face.area for face in faces if face.is_side(direction))
    return round((end_area + side_area) / total_area, 3), round(end_area / total_area, 3)


def _rotation_to_y(direction: Floats) -> Floats:
    """Return a rotation matrix (3, 3) that maps a unit vector to the y axis; it is the identity for the y axis.

    The rows of the matrix are the new x, y and z axes in the old coordinates.
    """
    y = direction
    # The new x axis is the old x axis, made perpendicular to the direction. If the old x axis is less than 45 degrees
    # from the direction, the old y axis is used instead.
    old_axis = np.array([1.0, 0.0, 0.0]) if abs(direction[0]) < math.sqrt(0.5) else np.array([0.0, 1.0, 0.0])
    x = old_axis - (old_axis @ y) * y
    x /= np.linalg.norm(x)
    return np.stack([x, y, np.cross(x, y)])


def _rotation_location(rotation: Floats) -> cq.Location:
    """Return the CadQuery location that rotates a shape by a matrix (3, 3)."""
    transform = OCP.gp.gp_Trsf()
    # Each row of the matrix is followed by a translation of 0.
    transform.SetValues(*(value for row in rotation.tolist() for value in (*row, 0.0)))
    return cq.Location(transform)


def _extrude_largest_section(part: Part, rotation: Floats) -> Extrusion | None:
    """Return the extrusion of the largest section perpendicular to y, or None if it does not describe the part.

    `rotation` (3, 3) is the rotation that was already applied to the part. None is returned if fewer than two levels
    have a face perpendicular to y, if the section is in pieces, or if another section has material outside it.
    """
    box = part.shape.BoundingBox()
    levels, cap_areas, slanted_edges = _levels_and_edges(part.shape)
    if len(cap_areas) < 2:  # noqa: PLR2004 - a sweep has two ends
        return None
    # The sweep ends at the two levels with the largest cap areas.
    levels_by_area = sorted(cap_areas, key=lambda level: -cap_areas[level])
    low, high = sorted(levels_by_area[:2])
    sections = [(_cut_across_y(part.shape, box, plane), plane) for plane in _section_planes(box, levels, low, high)]
    # Areas are rounded, so that round-off does not decide between sections of the same area.
    section, plane = max(sections, key=lambda candidate: round(candidate[0].Area(), 3))
    if len(section.Faces()) != 1:  # the section is in pieces, or empty
        return None
    # Material outside the section, such as a bridge or a second leaf, would be missing from the sweep.
    if any(_area_outside(other, level, section, plane) > _OUTSIDE_MM2 for other, level in sections if level != plane):
        return None
    return Extrusion(
        part=part,
        rotation=rotation,
        section=section.Faces()[0],
        lines=slanted_edges,
        low=low,
        high=high,
        plane=plane,
    )


def _section_planes(box: cq.BoundBox, levels: Sequence[float], low: float, high: float) -> list[float]:
    """Return the planes y [mm] in which a part is cut, each once: in the middle of the sweep, and between its levels.

    The sweep extends from `low` to `high` [mm]. At the `levels` [mm], the section of the part may change. `box` is the
    bounding box of the part. A layer at most `_THINNEST_LAYER_MM` thick is not cut.
    """
    neighbours = itertools.pairwise(sorted([box.ymin, box.ymax, *levels]))
    planes = [0.5 * (low + high)]
    planes += [round(0.5 * (a + b), 6) for a, b in neighbours if b - a > _THINNEST_LAYER_MM]
    return list(dict.fromkeys(planes))


def _levels_and_edges(shape: cq.Shape) -> tuple[list[float], dict[float, float], tuple[_Segment, ...]]:
    """Return the levels y [mm] at which the section of a shape may change, its cap areas, and its slanted edges.

    The cap areas [mm^2] are the areas of the faces perpendicular to y, keyed by level. The slanted edges are straight
    edges of slanted faces, projected onto the section.
    """
    y_axis = np.array([0.0, 1.0, 0.0])
    levels = []  # may hold a level several times
    slanted_edges = []
    cap_areas: dict[float, float] = {}
    for face in shape.Faces():
        normals = _FaceNormals(face)
        if normals.is_cap(y_axis):
            level = round(face.Center().y, 6)  # levels that differ only by round-off become equal
            levels.append(level)
            cap_areas[level] = cap_areas.get(level, 0.0) + normals.area
        elif not normals.is_side(y_axis):
            levels += _section_levels(face)
            slanted_edges += [_projected_edge(edge) for edge in face.Edges() if edge.geomType() == "LINE"]
    # An edge along y is projected onto one point, and is dropped. An edge between two slanted faces is kept once.
    long_edges = dict.fromkeys(edge for edge in slanted_edges if math.dist(*edge) > _NEAR_MM)
    return levels, cap_areas, tuple(long_edges)


def _cut_across_y(shape: cq.Shape, box: cq.BoundBox, plane: float) -> cq.Shape:
    """Return the section of a shape at y = `plane` [mm]; `box` is the bounding box of the shape."""
    width = 2.0 * max(box.xlen, box.zlen) + 2.0 * _MARGIN_MM
    centre = cq.Vector(box.center.x, plane, box.center.z)
    return cq.Face.makePlane(width, width, centre, cq.Vector(0.0, 1.0, 0.0)).intersect(shape)


def _section_levels(face: cq.Face) -> list[float]:
    """Return the levels y [mm] of a slanted face at which a bridge between other faces may begin or end.

    For any face, the levels of its corners are returned. For a curved face, its lowest and its highest level are added.
    """
    corners = [corner.Y for corner in face.Vertices()]
    box = face.BoundingBox()
    return corners if face.geomType() == "PLANE" else [*corners, box.ymin, box.ymax]


def _area_outside(other: cq.Shape, level: float, section: cq.Shape, plane: float) -> float:
    """Return the area [mm^2] of one section of a part that lies outside another section.

    The section `other` at y = `level` [mm] is compared with `section`, which lies at y = `plane` [mm].
    """
    other_in_plane = other.translate(cq.Vector(0.0, plane - level, 0.0))
    return float(other_in_plane.cut(section).Area()) if other.Area() > 0.0 else 0.0


def _pieces_along_y(face: cq.Face) -> Iterator[tuple[Floats, float]]:
    """Yield points (3,) [mm] spread over a face, and the share of its projected area along y at each point [mm^2].

    Each triangle of the face is divided into small triangles that are about 0.5 mm wide or less when seen along y. The
    projected area of the triangle is divided equally among its points, as in `_spread_points`.
    """
    corners, triangles = face.tessellate(_CHORD_MM, _ANGLE_RAD)
    positions = np.array([corner.toTuple() for corner in corners])
    for triangle in triangles:
        a, b, c = positions[list(triangle)]
        projected_area = 0.5 * abs(float(np.cross(b - a, c - a)[1]))
        count = max(1, math.ceil(math.sqrt(projected_area) / _PIECE_MM))
        piece_area = 2.0 * projected_area / (count * (count + 1))  # there are count (count + 1) / 2 pieces
        for centre in _spread_points(a, b, c, count):
            yield centre, piece_area


def _spread_points(a: Floats, b: Floats, c: Floats, count: int) -> Iterator[Floats]:
    """Yield count (count + 1) / 2 points (3,) [mm], spread evenly over the triangle with the corners a, b and c.

    The triangle is divided into count^2 equal triangles. The points are the centroids of those triangles that have the
    orientation of the original.
    """
    for i, j in itertools.product(range(count), repeat=2):
        # The centroid is a third of the way along each side of the small triangle at the position (i, j).
        r, s = (i + 1.0 / 3.0) / count, (j + 1.0 / 3.0) / count
        if r + s < 1.0:  # otherwise the centroid lies outside the original triangle
            yield a + r * (b - a) + s * (c - a)


def _projected_edge(edge: cq.Edge) -> _Segment:
    """Return the ends (x, z) [mm] of a straight edge projected onto the section, in ascending order.

    Two faces share an edge but may run along it in opposite directions. The order and the rounding make both results
    equal.
    """
    a, b = sorted((round(point.x, 6), round(point.z, 6)) for point in (edge.startPoint(), edge.endPoint()))
    return a, b


def own_part(solid: cq.Solid, faces: Mapping[str, tuple[int, ...]]) -> Part:
    """Return a solid as a `Part` with named faces; `faces` maps each name to indices in `solid.Faces()`."""
    return Part(name="part", shape=solid, faces=dict(faces))


def name_side_faces(part: Part, name: str, level: float) -> tuple[Part, bool]:
    """Name the plane faces at y = -`level` and y = `level` [mm], and return the part and whether it has such faces."""
    tests = [plane_face_test(1, side * level) for side in (-1.0, 1.0)]
    indices = tuple(index for index, face in enumerate(part.shape.Faces()) if any(test(face) for test in tests))
    return (replace(part, faces={**part.faces, name: indices}), True) if indices else (part, False)


@dataclass(frozen=True, kw_only=True, eq=False)
class Walls:
    """Points on the surface of a part, (3, n) [mm], and the element size required at each point, (n,) [mm]."""

    points: Floats
    sizes: Floats


def sample_wall_thickness(part: Part) -> Walls:
    """Return points on every face of a part, and the element size required at each: at most the wall thickness.

    At each point, a ray is cast into the material. The wall thickness is the distance to the face at which the ray
    leaves the part. A point is omitted if its ray hits no face. At a cylindrical face, the element size is also at most
    an eighth of the circumference.
    """
    shape = part.shape
    intersector = OCP.IntCurvesFace.IntCurvesFace_ShapeIntersector()
    intersector.Load(shape.wrapped, _KERNEL_TOLERANCE_MM)
    spacing = math.sqrt(float(shape.Area()) / _WALL_POINTS)
    points, sizes = [], []
    for face in shape.Faces():
        largest_size = _max_element_size(face)
        for point, normal in _points_and_normals(face, spacing):
            thickness = _wall_thickness(intersector, point, normal)
            if math.isfinite(thickness):
                points.append(point)
                sizes.append(min(largest_size, thickness))
    return Walls(points=np.array(points).T, sizes=np.array(sizes))


def _wall_thickness(
    intersector: OCP.IntCurvesFace.IntCurvesFace_ShapeIntersector, point: Floats, normal: Floats
) -> float:
    """Return the thickness [mm] of the wall below a point (3,) [mm] on a face; it is infinite if the ray hits no face.

    The intersector holds the part. The ray starts slightly inside the material and runs against the outer unit normal.
    """
    ray = OCP.gp.gp_Lin(OCP.gp.gp_Pnt(*(point - _STEP_MM * normal)), OCP.gp.gp_Dir(*(-normal)))
    intersector.Perform(ray, 0.0, LONGEST_MM)
    # A close hit may be on the face itself, because its triangles deviate from it by up to `_CHORD_MM`.
    return min((distance for distance in crossings_of(intersector) if distance > 2.0 * _CHORD_MM), default=math.inf)


def _max_element_size(face: cq.Face) -> float:
    """Return the largest element size [mm] at a cylindrical face: a quarter of half its circumference.

    With this size, at least four elements follow a half-round wall. The size is infinite for any other face.
    """
    cylinder = _cylinder_parameters(face)
    if cylinder is None:
        return math.inf
    radius = float(cylinder[0])
    return _CORNER_FRACTION * math.pi * radius


def _points_and_normals(face: cq.Face, spacing: float) -> Iterator[tuple[Floats, Floats]]:
    """Yield points (3,) [mm] on a face, about `spacing` [mm] apart, and the outer unit normal (3,) at each point.

    The points are spread evenly over each triangle of the face.
    """
    corners, triangles = face.tessellate(_CHORD_MM, _ANGLE_RAD)
    positions = np.array([corner.toTuple() for corner in corners])
    for triangle in triangles:
        a, b, c = positions[list(triangle)]
        normal = np.cross(b - a, c - a)
        doubled_area = float(np.linalg.norm(normal))
        if not doubled_area > _NEAR_MM**2:  # a collapsed triangle has no normal
            continue
        count = max(1, math.ceil(math.sqrt(doubled_area) / spacing))
        for point in _spread_points(a, b, c, count):
            yield point, normal / doubled_area
