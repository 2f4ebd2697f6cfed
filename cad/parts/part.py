"""A solid with named faces, and tests that find faces by their geometry."""

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
_NEAR_TURN = 1e-6  # [rad]
NEAR_MM = 1e-6  # well under any length of a design, well over the tolerance of the geometry kernel
_REACH_MM = 1.0  # extension of a cut beyond a plate


@dataclass(frozen=True, kw_only=True)
class Part:
    """A valid solid [mm] with named faces, whose names become gmsh groups, mesh boundaries and load cases.

    Faces are stored as indices into `shape.Faces()`, because a BREP file preserves their order but no names.
    """

    name: str
    shape: cq.Shape
    faces: Mapping[str, tuple[int, ...]]

    def face_area(self, name: str) -> float:
        """Return the area of a named face [mm^2]; raises KeyError with the known names for an unknown one."""
        if name not in self.faces:
            msg = f"face {name!r} is unknown on part {self.name!r}; known faces: {', '.join(self.faces)}"
            raise KeyError(msg)
        every = self.shape.Faces()
        return sum(every[index].Area() for index in self.faces[name])

    def face_distance(self, name: str, other: str) -> float:
        """Return the least distance between the centres of faces of two names [mm]."""
        every = self.shape.Faces()
        middles = [[every[place].Center() for place in self.faces[group]] for group in (name, other)]
        return min((a - b).Length for a in middles[0] for b in middles[1])

    @property
    def size(self) -> PartSize:
        """Return volume, surface and areas of named faces, with which a mesh of the solid is compared."""
        areas = {name: self.face_area(name) for name in self.faces}
        return PartSize(volume=float(self.shape.Volume()), surface=float(self.shape.Area()), areas=areas)

    def write_brep(self, path: Path) -> None:
        """Write the solid as a BREP file [mm], which keeps the order of the faces; raises OSError."""
        if not self.shape.exportBrep(str(path)):
            msg = f"part {self.name!r}: cannot write {path}; check that the folder exists and has room"
            raise OSError(msg)


def named_part(name: str, shape: cq.Shape, faces: Mapping[str, FaceTest]) -> Part:
    """Return a part with named faces; `faces` holds for each name a test that picks its faces.

    Raises ValueError if a name matches no face, or if two names match the same face.
    """
    solids = shape.Solids()
    if len(solids) == 1:  # CadQuery returns a cut solid as a compound
        shape = solids[0]
    every = shape.Faces()
    picked: dict[str, tuple[int, ...]] = {}
    owner: dict[int, str] = {}
    for face_name, belongs in faces.items():
        picked[face_name] = tuple(index for index, face in enumerate(every) if belongs(face))
        if not picked[face_name]:
            msg = f"part {name!r}: the name {face_name!r} matches no face; known names: {', '.join(faces)}"
            raise ValueError(msg)
        for index in picked[face_name]:
            if index in owner:
                msg = f"part {name!r}: face {index} is named both {owner[index]!r} and {face_name!r}"
                raise ValueError(msg)
            owner[index] = face_name
    return Part(name=name, shape=shape, faces=picked)


def box_through(depth: float, x: tuple[float, float], z: tuple[float, float]) -> cq.Solid:
    """Return a box between two x and two z [mm] that reaches 1 mm beyond both faces of a plate of this depth."""
    whole = depth + 2.0 * _REACH_MM
    return cq.Solid.makeBox(x[1] - x[0], whole, z[1] - z[0], cq.Vector(x[0], -0.5 * whole, z[0]))


def on_plane(axis: int, place: float) -> FaceTest:
    """Return the test for plane faces normal to an axis (0 for x, 1 for y, 2 for z) at the coordinate `place` [mm]."""

    def belongs(face: cq.Face) -> bool:
        corner = TopExp_Explorer(face.wrapped, TopAbs_VERTEX)
        if corner.More():  # one corner rules out most faces, in a tenth of the time of a bounding box
            coordinates = BRep_Tool.Pnt_s(TopoDS.Vertex_s(corner.Current()))
            if abs(coordinates.Coord(axis + 1) - place) > 2.0 * NEAR_MM:
                return False
        box = face.BoundingBox()
        start = (box.xmin, box.ymin, box.zmin)[axis]
        end = (box.xmax, box.ymax, box.zmax)[axis]
        return abs(start - place) < NEAR_MM and abs(end - place) < NEAR_MM

    return belongs


def is_hole(face: cq.Face, diameter: float) -> bool:
    """Return whether a face is a round hole of this diameter [mm]: a full cylinder, in contrast to a fillet."""
    if face.geomType() != "CYLINDER":
        return False
    # The bounding box is not used, because it grows when the face is divided into triangles.
    surface = BRepAdaptor_Surface(face.wrapped)
    turn: float = surface.LastUParameter() - surface.FirstUParameter()
    radius: float = surface.Cylinder().Radius()
    return abs(2.0 * radius - diameter) < NEAR_MM and abs(turn - 2.0 * math.pi) < _NEAR_TURN


def round_upright_edges(plate: cq.Workplane, corners: Sequence[Point], radius: float) -> cq.Workplane:
    """Return a plate whose edges along y at these corners (x, z) are rounded [mm].

    Raises ValueError if there is not exactly one edge for each corner.
    """
    edges = []
    for edge in plate.findSolid().Edges():
        box = edge.BoundingBox()
        is_upright = edge.geomType() == "LINE" and math.hypot(box.xlen, box.zlen) <= NEAR_MM
        if is_upright and any(math.dist((box.center.x, box.center.z), corner) < NEAR_MM for corner in corners):
            edges.append(edge)
    if len(edges) != len(corners):
        msg = f"number of edges to round = {len(edges)}: must be {len(corners)}; check the levels of the leaves"
        raise ValueError(msg)
    return plate.newObject(edges).fillet(radius)
