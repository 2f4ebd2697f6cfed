"""A solid that the user made: read, refused if it is not one part, its faces found, and turned as an extrusion."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cadquery as cq
import numpy as np
import OCP

from cad.checks.triangle_checks import LONGEST_MM, SHORTEST_MM
from cad.files.step import read_step
from cad.parts.housing import Housing
from cad.parts.part import Part, on_plane
from sensor.arrays import Flags, Floats
from sensor.quantity import InputError, validation_error

Place = tuple[float, float, float]

_INCH_MM = 25.4
_SAME_SIZE = 0.1  # relative: a part of a design is as large as its housing, and not an inch for a millimetre
_ON_FACE_MM = 0.05  # as far as geometry.as_designed lets a file of another program lie from its design
_TURNED = 1e-4  # largest component of a unit normal that still lies along or across the sweep
_SWEPT_SHARE = 0.8  # least share of the surface that must lie along or across the sweep
_SAMPLES = (0.1, 0.5, 0.9)  # parameters at which the normal of a face is taken, over their range
_NEAR_MM = 1e-5
_ONE_SIDED = 0.5  # least length of the mean normal of a face that has a direction; a closed ring has 0
_WALL_POINTS = 3000  # on a part, of its walls
_STEP_MM = 1e-3  # into a wall, where its thickness is measured
_CORNER_SHARE = 0.25  # size of an element at a round corner, over half the circle of its radius
_CHORD_MM, _ANGLE_RAD = 0.01, 0.3
_BESIDE_MM2 = 0.01  # largest area by which another section may differ from the swept one
_UNEVEN = 1e-3  # largest offset between the middle of a face and the middle of the part, over the depth
_PIECE_MM = 0.5  # size of the pieces of a face on which the depths of part and mesh are compared
_BEYOND = 1.0  # [mm] that a line begins before the part


def own_solid(shape: cq.Shape, name: str, housing: Housing | None = None, *, any_size: bool = False) -> cq.Solid:
    """Return the one solid [mm] of a shape; raises InputError where it is none, several, open or of another size.

    With a housing, inches that were written as millimetres are recognised by its size. `any_size` is for a check before
    the housing is known.
    """
    solids = shape.Solids()
    if not solids:
        bound = f"one closed solid: it has {len(shape.Faces())} faces that enclose none"
        raise validation_error("PART", name, "", bound, "close its surface and export the solid")
    if len(solids) > 1:
        places = "; ".join(_place_of(solid) for solid in solids[:3])
        bound = f"one body: it has {len(solids)}, of {places}"
        raise validation_error("PART", name, "", bound, "join them, or export the part that is printed")
    loose = len(shape.Faces()) - len(solids[0].Faces())
    if loose:
        bound = f"one closed solid: {loose} faces bound none"
        raise validation_error("PART", name, "", bound, "export the solid without them")
    solid = solids[0]
    if not OCP.BRepCheck.BRepCheck_Analyzer(solid.wrapped).IsValid() or not solid.Volume() > 0.0:
        bound = "a valid closed solid by OCCT"
        raise validation_error("PART", name, "", bound, "heal it in the program that made it, and export it again")
    if not any_size:
        _check_size(solid, name, housing)
    return solid


def _place_of(solid: cq.Solid) -> str:
    x, y, z = solid.Center().toTuple()
    return f"{solid.Volume():.4g} mm^3 at ({x:.4g}, {y:.4g}, {z:.4g}) mm"


def _check_size(solid: cq.Solid, name: str, housing: Housing | None) -> None:
    """Raise InputError for a solid that is too small or too large for a part in millimetres."""
    box = solid.BoundingBox()
    longest = max(box.xlen, box.ylen, box.zlen)
    size = f"{box.xlen:.4g} x {box.ylen:.4g} x {box.zlen:.4g} mm"
    if housing is not None:
        ratio = (housing.right - housing.left) / longest
        for factor, written, meant in ((_INCH_MM, "inches", "smaller"), (1.0 / _INCH_MM, "inches twice", "larger")):
            if abs(ratio / factor - 1.0) < _SAME_SIZE:
                bound = (
                    f"in millimetres: at {size} it is {_INCH_MM:g} times {meant} than the design, as if in {written}"
                )
                raise validation_error("PART", name, "", bound, "export it in millimetres")
    if not SHORTEST_MM <= longest <= LONGEST_MM:
        bound = f"{SHORTEST_MM:g} to {LONGEST_MM:g} mm long: it is {size}"
        raise validation_error("PART", name, "", bound, "export it in millimetres, and one part only")


def read_own_solid(path: Path, housing: Housing | None = None, *, any_size: bool = False) -> cq.Solid:
    """Return the one solid [mm] of a STEP file; raises InputError where it has none or cannot be read."""
    try:
        shape = read_step(path)
    except ValueError as error:
        raise InputError(str(error)) from error
    return own_solid(shape, path.name, housing, any_size=any_size)


def faces_at(solid: cq.Solid, flag: str, points: Sequence[Place]) -> tuple[int, ...]:
    """Return the faces of a solid on which points [mm] lie, by their places in `solid.Faces()`.

    A round wall that is divided lengthwise is one face. Raises InputError for a point on no face.
    """
    every = solid.Faces()
    found: list[int] = []
    for point in points:
        vertex = cq.Vertex.makeVertex(*point)
        distances = [face.distance(vertex) for face in every]
        nearest = int(np.argmin(distances))
        if not distances[nearest] <= _ON_FACE_MM:
            place = ",".join(f"{value:g}" for value in point)
            bound = f"within {_ON_FACE_MM:g} mm of a face: the nearest is {distances[nearest]:.3g} mm away"
            raise validation_error(flag, place, "mm", bound, "take a point on the face, in the frame of the file")
        wall = _whole_wall(every, nearest)
        _refuse_edge(every, distances, wall, flag, point)
        found += wall
    return tuple(dict.fromkeys(found))


def _refuse_edge(
    every: Sequence[cq.Face], distances: Sequence[float], wall: Sequence[int], flag: str, point: Place
) -> None:
    """Raise InputError for a point on the edge between a wall and a face that looks another way."""
    at = cq.Vector(*point)
    for place, face in enumerate(every):
        if place in wall or distances[place] > min(distances) + _NEAR_MM:
            continue
        if abs(face.normalAt(at).dot(every[wall[0]].normalAt(at))) < 1.0 - _TURNED:
            where = ",".join(f"{value:g}" for value in point)
            bound = "on one face: it lies on the edge between two"
            raise validation_error(flag, where, "mm", bound, "take a point inside the face")


def _whole_wall(every: Sequence[cq.Face], place: int) -> list[int]:
    """Return a face with those that lie on the same cylinder and meet it."""
    axis = _cylinder(every[place])
    if axis is None:
        return [place]
    same = []
    for number, face in enumerate(every):
        other = _cylinder(face)
        if other is not None and np.allclose(axis, other, atol=_NEAR_MM) and face.distance(every[place]) < _NEAR_MM:
            same.append(number)
    return same


def _cylinder(face: cq.Face) -> Floats | None:
    """Return radius, direction and the foot of the axis of a cylinder, as one vector; None for another face."""
    if face.geomType() != "CYLINDER":
        return None
    cylinder = OCP.BRepAdaptor.BRepAdaptor_Surface(face.wrapped).Cylinder()
    line = cylinder.Axis()
    direction = np.array([line.Direction().X(), line.Direction().Y(), line.Direction().Z()])
    direction *= np.sign(direction[np.argmax(np.abs(direction))])
    foot = np.array([line.Location().X(), line.Location().Y(), line.Location().Z()])
    foot = foot - (foot @ direction) * direction
    return np.concatenate([[cylinder.Radius()], direction, foot])


def tagged_faces(plane: object, solid: cq.Solid, flag: str, tag: str) -> tuple[int, ...]:
    """Return the faces of a solid that have a tag on a workplane of CadQuery; raises InputError for none."""
    tags = plane.ctx.tags if isinstance(plane, cq.Workplane) else {}
    if tag not in tags:
        names = ", ".join(tags) or "none"
        raise validation_error(
            flag, tag, "", f"a tag of the workplane, which has {names}", "tag the face, or give a point"
        )
    tagged = [face for value in tags[tag].vals() if isinstance(value, cq.Shape) for face in value.Faces()]
    every = solid.Faces()
    places = [place for place, face in enumerate(every) if any(face.isSame(other) for other in tagged)]
    if not places:
        bound = "a tag of faces that the part still has"
        raise validation_error(flag, tag, "", bound, "tag the faces of the finished part")
    return tuple(places)


def pressed_direction(solid: cq.Solid, flag: str, places: Sequence[int]) -> Place:
    """Return the unit direction of a press on faces, against their mean outer normal; raises InputError for a ring."""
    every = solid.Faces()
    total = np.zeros(3)
    area = 0.0
    for face in (every[place] for place in places):
        mean = _FaceNormals(face).normals.mean(axis=0)
        total += face.Area() * (mean if face.wrapped.Orientation() != OCP.TopAbs.TopAbs_REVERSED else -mean)
        area += face.Area()
    length = float(np.linalg.norm(total))
    if not length > _ONE_SIDED * area:
        bound = "a face that looks one way"
        raise validation_error(flag, "a face all round", "", bound, "press a plane face or a dome")
    x, y, z = np.round(-total / length, 9) + 0.0
    return float(x), float(y), float(z)


def as_one_shape(solid: object) -> cq.Shape:
    """Return a shape, or what lies on a workplane as one."""
    if isinstance(solid, cq.Shape):
        return solid
    if not isinstance(solid, cq.Workplane):
        bound = "a workplane or a shape of CadQuery"
        raise validation_error(
            "PART", type(solid).__name__, "", bound, "take the part of an assembly or a file by itself"
        )
    shapes = [value for value in solid.vals() if isinstance(value, cq.Shape)]
    return shapes[0] if len(shapes) == 1 else cq.Compound.makeCompound(shapes)


def with_flat_tips(solid: cq.Solid, points: Iterable[Place]) -> cq.Solid:
    """Return a solid whose round tips are filled up to the plane that touches them at points [mm], as solvers have it.

    A round tip as a bar adds less than 5e-4 to 1 / K_h (tests/cad/parts/test_domes.py).
    """
    shape: cq.Shape = solid
    for point in points:
        vertex = cq.Vertex.makeVertex(*point)
        face = min(solid.Faces(), key=lambda each: each.distance(vertex))
        if face.geomType() == "SPHERE" and face.distance(vertex) <= _ON_FACE_MM:
            box = face.BoundingBox()
            corner = cq.Vector(box.xmin, box.ymin, box.zmin)
            shape = shape.fuse(cq.Solid.makeBox(box.xlen, box.ylen, box.zlen, corner))
    return solid if shape is solid else shape.clean().Solids()[0]


def tip_points(housing: Housing) -> dict[str, Place]:
    """Return the point of each tip of a design's housing that touches first [mm]."""
    return {arm.name: (arm.centre, 0.0, 0.0) for arm in housing.arms}


def hole_points(housing: Housing) -> tuple[Place, ...]:
    """Return a point on the wall of each screw hole of a design's housing [mm], in the middle of its depth."""
    return tuple((x + 0.5 * housing.hole_diameter, 0.0, z) for x, z in housing.holes)


@dataclass(frozen=True, kw_only=True, eq=False)
class Extrusion:
    """A part as a section that is swept along y, turned so from its own frame by `turn` (3, 3).

    `lines` are the straight edges of slanted faces in the section, ((x, z), (x, z)) [mm]. The sweep goes from the level
    `low` to `high` [mm]; `plane` is the level of the section.
    """

    part: Part
    turn: Floats
    section: cq.Face
    lines: tuple[tuple[tuple[float, float], tuple[float, float]], ...]
    low: float
    high: float
    plane: float

    def spans(self, x: Floats, z: Floats) -> tuple[Floats, Floats, Floats]:
        """Return where lines along y enter and leave the part, and how much of it is between [mm], 0 beside it."""
        caster = OCP.IntCurvesFace.IntCurvesFace_ShapeIntersector()
        caster.Load(self.part.shape.wrapped, 1e-7)
        along = OCP.gp.gp_Dir(0.0, 1.0, 0.0)
        box = self.part.shape.BoundingBox()
        below, reach = box.ymin - _BEYOND, box.ylen + 2.0 * _BEYOND
        entered, left, inside = np.zeros(len(x)), np.zeros(len(x)), np.zeros(len(x))
        for i, (place_x, place_z) in enumerate(zip(x.tolist(), z.tolist(), strict=True)):
            line = OCP.gp.gp_Lin(OCP.gp.gp_Pnt(place_x, below, place_z), along)
            caster.Perform(line, 0.0, reach)
            levels = sorted(caster.WParameter(number + 1) for number in range(caster.NbPnt()))
            levels = [level for level, after in itertools.pairwise([*levels, math.inf]) if after - level > _NEAR_MM]
            if len(levels) > 1:
                entered[i], left[i] = levels[0], levels[-1]
                inside[i] = sum(b - a for a, b in zip(levels[::2], levels[1::2], strict=False))
        return entered + below, left + below, inside

    def uneven(self) -> Iterator[tuple[Floats, float, float]]:
        """Yield where the depth of the part changes: (x, z), the area of a small piece there, and the feature's width.

        Those are the bottoms of pockets and tops of ribs, and slanted faces, in small pieces [mm, mm^2]. A narrow one,
        as the cut of a saw, lies between lines of any grid.
        """
        for face in self.part.shape.Faces():
            normals = _FaceNormals(face)
            across = np.array([0.0, 1.0, 0.0])
            is_end = (
                normals.is_cap(across) and min(abs(normals.middle[1] - at) for at in (self.low, self.high)) < _NEAR_MM
            )
            if is_end or normals.is_side(across):
                continue
            pieces = [(middle[[0, 2]], area) for middle, area in _seen_along_y(face) if area > _NEAR_MM**2]
            box = face.BoundingBox()
            width = sum(area for _, area in pieces) / math.hypot(box.xlen, box.zlen)
            yield from ((middle, area, width) for middle, area in pieces)

    def is_even(self, name: str) -> bool:
        """Return whether named faces lie as much on one side of the middle of the depth as on the other."""
        every = self.part.shape.Faces()
        faces = [every[place] for place in self.part.faces[name]]
        moment = sum(face.Area() * (face.Center().y - 0.5 * (self.low + self.high)) for face in faces)
        return abs(moment) < _UNEVEN * (self.high - self.low) * sum(face.Area() for face in faces)

    def polygon_area(self, name: str) -> float | None:
        """Return the area of named faces [mm^2]; None if one is curved or has a curved edge."""
        every = self.part.shape.Faces()
        faces = [every[place] for place in self.part.faces[name]]
        is_straight = all(
            face.geomType() == "PLANE" and all(edge.geomType() == "LINE" for edge in face.Edges()) for face in faces
        )
        return sum(face.Area() for face in faces) if is_straight else None

    def lies_on(self, name: str, points: Floats, tolerance: float) -> Flags:
        """Say of points (3, n) [mm] whether they lie on a named face within a tolerance."""
        found = np.zeros(points.shape[1], dtype=bool)
        every = self.part.shape.Faces()
        for face in (every[place] for place in self.part.faces[name]):
            box = face.BoundingBox()
            least = np.array([[box.xmin], [box.ymin], [box.zmin]]) - tolerance
            most = np.array([[box.xmax], [box.ymax], [box.zmax]]) + tolerance
            for place in np.flatnonzero(((points >= least) & (points <= most)).all(axis=0) & ~found):
                found[place] = face.distance(cq.Vertex.makeVertex(*points[:, place].tolist())) <= tolerance
        return found


def extrusion_of(part: Part) -> Extrusion | None:
    """Return a part as a swept section; None if too much of its surface lies neither along nor across any sweep."""
    faces = [_FaceNormals(face) for face in part.shape.Faces()]
    best = max(_directions(faces), key=lambda direction: _rank(faces, direction), default=None)
    if best is None or _rank(faces, best)[0] < _SWEPT_SHARE:
        return None
    turn = _turn_to_y(best)
    turned = part if np.allclose(turn, np.eye(3)) else replace(part, shape=part.shape.moved(_location(turn)))
    return _section_of(turned, turn)


class _FaceNormals:
    """A face with its area [mm^2], its middle [mm] and its unit normals at some points, (n, 3)."""

    def __init__(self, face: cq.Face) -> None:
        """Look at the face at nine points of its parameters."""
        self.area = float(face.Area())
        self.middle = np.array(face.Center().toTuple())
        u0, u1, v0, v1 = face._uvBounds()
        surface = OCP.BRepAdaptor.BRepAdaptor_Surface(face.wrapped)
        normals = []
        for u, v in itertools.product(_SAMPLES, _SAMPLES):
            props = OCP.BRepLProp.BRepLProp_SLProps(surface, u0 + u * (u1 - u0), v0 + v * (v1 - v0), 1, 1e-9)
            if props.IsNormalDefined():
                normal = props.Normal()
                normals.append((normal.X(), normal.Y(), normal.Z()))
        self.normals = np.array(normals or [(0.0, 0.0, 0.0)])

    def is_cap(self, direction: Floats) -> bool:
        """Return whether the face lies across a direction."""
        return bool((np.abs(self.normals @ direction) > 1.0 - _TURNED**2).all())

    def is_side(self, direction: Floats) -> bool:
        """Return whether the face lies along a direction."""
        return bool((np.abs(self.normals @ direction) < _TURNED).all())


def _directions(faces: Sequence[_FaceNormals]) -> Iterator[Floats]:
    """Yield the normals of plane faces, each direction once; normals along the axes are exact."""
    seen: list[Floats] = []
    for face in sorted(faces, key=lambda face: -face.area):
        normal = face.normals[0]
        if not np.allclose(face.normals, normal, atol=_TURNED) or not normal.any():
            continue
        normal = np.round(normal * np.sign(normal[np.argmax(np.abs(normal))]), 9) + 0.0
        if all(abs(normal @ other) < 1.0 - _TURNED**2 for other in seen):
            seen.append(normal)
            yield normal


def _rank(faces: Sequence[_FaceNormals], direction: Floats) -> tuple[float, float]:
    """Return the share of the surface that a sweep along a direction makes, and of its ends, to three digits [1]."""
    total = sum(face.area for face in faces)
    levels: dict[float, float] = {}
    for face in faces:
        if face.is_cap(direction):
            level = round(float(face.middle @ direction), 4)
            levels[level] = levels.get(level, 0.0) + face.area
    ends = sum(sorted(levels.values())[-2:])
    sides = sum(face.area for face in faces if face.is_side(direction))
    return round((ends + sides) / total, 3), round(ends / total, 3)


def _turn_to_y(direction: Floats) -> Floats:
    """Return the turn (3, 3) that brings a direction to y; none for y itself."""
    y = direction
    x = np.array([1.0, 0.0, 0.0]) if abs(direction[0]) < math.sqrt(0.5) else np.array([0.0, 1.0, 0.0])
    x = x - (x @ y) * y
    x /= np.linalg.norm(x)
    return np.stack([x, y, np.cross(x, y)])


def _location(turn: Floats) -> cq.Location:
    """Return a turn (3, 3) as CadQuery has it."""
    motion = OCP.gp.gp_Trsf()
    motion.SetValues(*(value for row in turn.tolist() for value in (*row, 0.0)))
    return cq.Location(motion)


def _section_of(part: Part, turn: Floats) -> Extrusion | None:
    """Return the largest section across y of a turned part, with its sweep; None if it is in pieces."""
    across = np.array([0.0, 1.0, 0.0])
    shape = part.shape
    box = shape.BoundingBox()
    levels = [box.ymin, box.ymax]
    lines = []
    caps: dict[float, float] = {}
    for face in shape.Faces():
        normals = _FaceNormals(face)
        if normals.is_cap(across):
            level = round(face.Center().y, 6)
            levels.append(level)
            caps[level] = caps.get(level, 0.0) + normals.area
        elif not normals.is_side(across):
            levels += _levels_of(face)
            lines += [_line(edge) for edge in face.Edges() if edge.geomType() == "LINE"]
    if len(caps) < 2:  # noqa: PLR2004 - a sweep has two ends
        return None
    low, high = sorted(sorted(caps, key=lambda level: -caps[level])[:2])
    wide = 2.0 * max(box.xlen, box.zlen) + 2.0 * _BEYOND
    apart = itertools.pairwise(sorted(levels))
    planes = [0.5 * (low + high), *(round(0.5 * (a + b), 6) for a, b in apart if b - a > _STEP_MM)]
    sections = []
    for plane in dict.fromkeys(planes):
        centre = cq.Vector(box.center.x, plane, box.center.z)
        sections.append((cq.Face.makePlane(wide, wide, centre, cq.Vector(0.0, 1.0, 0.0)).intersect(shape), plane))
    section, plane = max(sections, key=lambda each: round(each[0].Area(), 3))
    if len(section.Faces()) != 1:
        return None
    # A bridge or a second leaf beside the section would be lost without a word.
    if any(_beside(other, level, section, plane) > _BESIDE_MM2 for other, level in sections if level != plane):
        return None
    long = tuple(dict.fromkeys(line for line in lines if math.dist(*line) > _NEAR_MM))
    return Extrusion(part=part, turn=turn, section=section.Faces()[0], lines=long, low=low, high=high, plane=plane)


def _levels_of(face: cq.Face) -> list[float]:
    """Return the levels y at which a slanted face begins, ends or turns [mm]: a bridge may lie between them."""
    corners = [corner.Y for corner in face.Vertices()]
    box = face.BoundingBox()
    return corners if face.geomType() == "PLANE" else [*corners, box.ymin, box.ymax]


def _beside(other: cq.Shape, level: float, section: cq.Shape, plane: float) -> float:
    """Return the area of a section that lies beside another of the same part [mm^2]."""
    moved = other.translate(cq.Vector(0.0, plane - level, 0.0))
    return float(moved.cut(section).Area()) if other.Area() > 0.0 else 0.0


def _seen_along_y(face: cq.Face) -> Iterator[tuple[Floats, float]]:
    """Yield the middles of small pieces of a face [mm], with the area of each as seen along y [mm^2]."""
    corners, triangles = face.tessellate(_CHORD_MM, _ANGLE_RAD)
    places = np.array([corner.toTuple() for corner in corners])
    for triangle in triangles:
        a, b, c = places[list(triangle)]
        seen = 0.5 * abs(float(np.cross(b - a, c - a)[1]))
        count = max(1, math.ceil(math.sqrt(seen) / _PIECE_MM))
        for i, j in itertools.product(range(count), repeat=2):
            r, s = (i + 1.0 / 3.0) / count, (j + 1.0 / 3.0) / count
            if r + s < 1.0:
                yield a + r * (b - a) + s * (c - a), 2.0 * seen / (count * (count + 1))


def _line(edge: cq.Edge) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the ends of a straight edge in the section (x, z) [mm], in order."""
    a, b = sorted((round(point.x, 6), round(point.z, 6)) for point in (edge.startPoint(), edge.endPoint()))
    return a, b


def own_part(solid: cq.Solid, faces: Mapping[str, tuple[int, ...]]) -> Part:
    """Return a solid with its named faces."""
    return Part(name="part", shape=solid, faces=dict(faces))


def with_sides(part: Part, name: str, level: float) -> tuple[Part, bool]:
    """Return a part with its faces at y = -+ level [mm] under a name, and whether there are any."""
    tests = [on_plane(1, sign * level) for sign in (-1.0, 1.0)]
    places = tuple(i for i, face in enumerate(part.shape.Faces()) if any(test(face) for test in tests))
    return (replace(part, faces={**part.faces, name: places}), True) if places else (part, False)


@dataclass(frozen=True, kw_only=True, eq=False)
class Walls:
    """Points (3, n) on the surface of a part [mm], and the element size [mm] required by a thin wall or a curve."""

    points: Floats
    sizes: Floats


def walls_of(part: Part) -> Walls:
    """Return points on every face of a part, with the thickness of the wall there, less at round inner corners."""
    shape = part.shape
    caster = OCP.IntCurvesFace.IntCurvesFace_ShapeIntersector()
    caster.Load(shape.wrapped, 1e-7)
    apart = math.sqrt(float(shape.Area()) / _WALL_POINTS)
    points, sizes = [], []
    for face in shape.Faces():
        least = _corner_size(face)
        for point, normal in _points_on(face, apart):
            line = OCP.gp.gp_Lin(OCP.gp.gp_Pnt(*(point - _STEP_MM * normal)), OCP.gp.gp_Dir(*(-normal)))
            caster.Perform(line, 0.0, LONGEST_MM)
            # The nearest may be the face itself, beside which a triangle lies by its chord.
            depths = [caster.WParameter(number + 1) for number in range(caster.NbPnt())]
            depth = min((depth for depth in depths if depth > 2.0 * _CHORD_MM), default=math.inf)
            if math.isfinite(depth):
                points.append(point)
                sizes.append(min(least, depth))
    return Walls(points=np.array(points).T, sizes=np.array(sizes))


def _corner_size(face: cq.Face) -> float:
    """Return half a quarter of the round of a cylinder that is hollow [mm]; infinity for another face."""
    axis = _cylinder(face)
    return math.inf if axis is None else _CORNER_SHARE * math.pi * float(axis[0])


def _points_on(face: cq.Face, apart: float) -> Iterator[tuple[Floats, Floats]]:
    """Yield points on a face some distance apart [mm], with the outer normal at each."""
    corners, triangles = face.tessellate(_CHORD_MM, _ANGLE_RAD)
    places = np.array([corner.toTuple() for corner in corners])
    for triangle in triangles:
        a, b, c = places[list(triangle)]
        normal = np.cross(b - a, c - a)
        length = float(np.linalg.norm(normal))
        if not length > _NEAR_MM**2:
            continue
        count = max(1, math.ceil(math.sqrt(length) / apart))
        for i, j in itertools.product(range(count), repeat=2):
            r, s = (i + 1.0 / 3.0) / count, (j + 1.0 / 3.0) / count
            if r + s < 1.0:
                yield a + r * (b - a) + s * (c - a), normal / length
