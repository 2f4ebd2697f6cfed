"""A solid with named faces, and functions that identify faces by their geometry."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import cadquery as cq
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.TopAbs import TopAbs_VERTEX
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS

from cad.parts.housing import PartSize, Point

FaceTest = Callable[["cq.Face"], bool]
_NEAR_RAD = 1e-6  # largest difference of the angle of a hole from a full circle
NEAR_MM = 1e-6  # distance below which points coincide: far below all lengths of a design, far above round-off
_MARGIN_MM = 1.0  # extension of a cut beyond a plate


@dataclass(frozen=True, kw_only=True)
class Part:
    """A valid solid [mm] with named faces. Meshes and load cases refer to the faces by these names.

    Faces are stored as indices into `shape.Faces()`, because a BREP file preserves their order but not their names.
    """

    name: str
    shape: cq.Shape
    faces: Mapping[str, tuple[int, ...]]

    def face_area(self, name: str) -> float:
        """Return the total area of the faces with this name [mm^2]. Raises KeyError for an unknown name."""
        if name not in self.faces:
            msg = f"part {self.name!r} has no face {name!r}. Its faces are {', '.join(self.faces)}."
            raise KeyError(msg)
        all_faces = self.shape.Faces()
        return sum(all_faces[index].Area() for index in self.faces[name])

    def face_distance(self, name: str, other: str) -> float:
        """Return the smallest distance [mm] between the centres of two faces, one with each of the two names."""
        all_faces = self.shape.Faces()
        centres = [[all_faces[index].Center() for index in self.faces[face_name]] for face_name in (name, other)]
        return min((a - b).Length for a in centres[0] for b in centres[1])

    @property
    def size(self) -> PartSize:
        """Return the volume, the surface area and the areas of the named faces, which a mesh must reproduce."""
        areas = {name: self.face_area(name) for name in self.faces}
        return PartSize(volume=float(self.shape.Volume()), surface=float(self.shape.Area()), areas=areas)

    def write_brep(self, path: Path) -> None:
        """Write the solid to a BREP file [mm], which preserves the order of the faces. Raises OSError if this fails."""
        if not self.shape.exportBrep(str(path)):
            msg = f"part {self.name!r}: cannot write {path}. Check that the folder exists and the disk is not full."
            raise OSError(msg)


def named_part(name: str, shape: cq.Shape, faces: Mapping[str, FaceTest]) -> Part:
    """Name the faces of a shape, and return it as a part.

    `name` is the name of the part. `faces` maps the name of each face to a test that selects all faces with this name.
    A face that no test selects remains without a name. Raises ValueError if a name matches no face, or if two names
    match the same face.
    """
    solids = shape.Solids()
    if len(solids) == 1:  # the result of a cut is a compound, even if it contains only one solid
        shape = solids[0]
    all_faces = shape.Faces()
    indices: dict[str, tuple[int, ...]] = {}  # into `all_faces`, for each name
    name_of_face: dict[int, str] = {}  # keyed by the same indices
    for face_name, is_match in faces.items():
        indices[face_name] = tuple(index for index, face in enumerate(all_faces) if is_match(face))
        if not indices[face_name]:
            msg = f"part {name!r}: the name {face_name!r} matches no face. The names are {', '.join(faces)}."
            raise ValueError(msg)
        for index in indices[face_name]:
            if index in name_of_face:
                msg = f"part {name!r}: face {index} matches both {name_of_face[index]!r} and {face_name!r}."
                raise ValueError(msg)
            name_of_face[index] = face_name
    return Part(name=name, shape=shape, faces=indices)


def box_through(depth: float, x: tuple[float, float], z: tuple[float, float]) -> cq.Solid:
    """Return a box between two x and two z coordinates [mm] that cuts through a plate of this depth [mm].

    The box extends 1 mm beyond both faces of the plate.
    """
    length = depth + 2.0 * _MARGIN_MM
    return cq.Solid.makeBox(x[1] - x[0], length, z[1] - z[0], cq.Vector(x[0], -0.5 * length, z[0]))


def plane_face_test(axis: int, coordinate: float) -> FaceTest:
    """Return a test that accepts the faces in a plane normal to an axis, at the given coordinate [mm].

    `axis` is 0 for x, 1 for y and 2 for z. Coordinates may differ by `NEAR_MM`.
    """

    def is_on_plane(face: cq.Face) -> bool:
        """Return whether the whole face lies in the plane. One corner is checked first, then the bounding box."""
        # A single corner rules out most faces, and is found in a tenth of the time of a bounding box. Its tolerance is
        # wider, so that only the bounding box decides about a face near the limit.
        corners = TopExp_Explorer(face.wrapped, TopAbs_VERTEX)
        if corners.More():  # the face has a corner
            corner = BRep_Tool.Pnt_s(TopoDS.Vertex_s(corners.Current()))
            if abs(corner.Coord(axis + 1) - coordinate) > 2.0 * NEAR_MM:  # the kernel numbers the axes from 1
                return False
        box = face.BoundingBox()
        lowest = (box.xmin, box.ymin, box.zmin)[axis]
        highest = (box.xmax, box.ymax, box.zmax)[axis]
        return abs(lowest - coordinate) < NEAR_MM and abs(highest - coordinate) < NEAR_MM

    return is_on_plane


def is_hole(face: cq.Face, diameter: float) -> bool:
    """Return whether a face is a round hole of this diameter [mm]. Unlike a fillet, a hole is a full cylinder."""
    if face.geomType() != "CYLINDER":
        return False
    # The bounding box is not used, because it becomes larger when the face is divided into triangles.
    surface = BRepAdaptor_Surface(face.wrapped)
    angle: float = surface.LastUParameter() - surface.FirstUParameter()
    radius: float = surface.Cylinder().Radius()
    return abs(2.0 * radius - diameter) < NEAR_MM and abs(angle - 2.0 * math.pi) < _NEAR_RAD


def fillet_edges_along_y(plate: cq.Workplane, corners: Sequence[Point], radius: float) -> cq.Workplane:
    """Round the edges of a plate that run along y at the given corners (x, z) [mm], with a fillet of this radius [mm].

    Raises ValueError unless exactly one edge is found for each corner. A corner without an edge would silently keep its
    sharp edge, which changes the stiffness of a leaf.
    """
    edges = []
    for edge in plate.findSolid().Edges():
        box = edge.BoundingBox()
        is_along_y = edge.geomType() == "LINE" and math.hypot(box.xlen, box.zlen) <= NEAR_MM
        position = (box.center.x, box.center.z)
        if is_along_y and any(math.dist(position, corner) < NEAR_MM for corner in corners):
            edges.append(edge)
    if len(edges) != len(corners):
        msg = f"number of edges to round = {len(edges)} must be {len(corners)}. Check the levels of the leaves."
        raise ValueError(msg)
    return plate.newObject(edges).fillet(radius)
