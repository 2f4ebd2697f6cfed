"""Meshes of a housing solid, or its half y >= 0, in curved quadratic tetrahedra, for an independent check of stiffness.

They share only the names of faces with the swept mesh of the product; the solid may come from a STEP file.
"""

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import gmsh
import numpy as np
from skfem import MeshTet1, MeshTet2
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTet

from cad.parts.housing import Housing
from cad.parts.part import Part
from mesh.quality import compare
from mesh.session import Ints, MeshError, element_nodes, gmsh_session, index_by_nodes, stage, used_nodes

_NEAR = 1e-5  # tolerance of coordinates [mm], and relative tolerance of areas
VOLUME = 1e-4  # relative tolerance of the volume
_STRETCH = 3.0  # length of the elements along the depth over their size in the plane of the plate
_UNFOLDINGS = 3  # passes that straighten folded elements
_FRAME = 3.0  # size away from the leaves [mm], at size 1
_LEAF = 0.6  # size in a leaf over its thickness, at size 1
_ROOT = 0.4  # size at a leaf root over its fillet, at size 1
_REACH = 6.0  # distance over which the size grows from a box to the frame [mm]
_AROUND = 14.0  # elements around a full circle, at size 1; fewer fold when they are curved
_PAIRS = ((0, 1), (1, 2), (2, 0), (3, 0), (2, 3), (1, 3))  # ends of the edge nodes 4 to 9 of gmsh's tetrahedron


@dataclass(frozen=True, kw_only=True)
class Box:
    """A box (x0, z0, x1, z1) over the whole depth [mm] with the element size inside [mm]."""

    corners: tuple[float, float, float, float]
    size: float


def fine_boxes(housing: Housing, size: float) -> list[Box]:
    """Return boxes of small elements around leaves, roots and tips; `size` scales all element sizes [1]."""
    boxes = []
    for arm in housing.arms:
        t, r, roots = arm.flexure.thickness, arm.flexure.fillet, arm.roots
        for level in arm.levels:
            low, high = level - 0.5 * t, level + 0.5 * t
            boxes.append(Box(corners=(roots[0], low, roots[1], high), size=_LEAF * size * t))
            boxes += [Box(corners=(x - r, low - r, x + r, high + r), size=_ROOT * size * r) for x in roots]
    half = 0.5 * housing.tip_side
    for x in (-0.5 * housing.spacing, 0.5 * housing.spacing):
        corners = (x - half, 0.0, x + half, 2.0 * housing.tip_height)
        boxes.append(Box(corners=corners, size=0.5 * size * housing.tip_side))
    return boxes


def tetrahedra(
    part: Part, boxes: Sequence[Box], size: float, *, whole: bool = False, tolerance: float = VOLUME
) -> MeshTet2:
    """Return the mesh [mm] of a whole part, or of its half y >= 0 with a boundary `symmetry`.

    Named faces are boundaries. `size` scales the elements outside the boxes [1]. `tolerance` is the largest relative
    difference of volume [1]. Raises MeshError with the stage that failed.
    """
    with gmsh_session():
        with stage("size", "check the sizes"):
            # Second order puts the midpoints of edges on arcs too; `_read` copies them to scikit-fem's mesh.
            gmsh.option.setNumber("Mesh.ElementOrder", 2.0)
            gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", _AROUND / size)
        names = _imported(part, whole=whole)
        _set_sizes(part, boxes, size)
        with stage("generate", "take smaller elements, or check the solid"):
            gmsh.model.mesh.generate(3)
        with stage("read", "check the solid"):
            mesh = _read(names)
    volume = float(part.shape.Volume())
    _check(mesh, volume if whole else 0.5 * volume, tolerance)
    return mesh


def _imported(part: Part, *, whole: bool) -> dict[str, list[int]]:
    """Load the part into gmsh, cut at y = 0 unless whole and flattened along y; return surface tags by face name."""
    occ = gmsh.model.occ
    box = part.shape.BoundingBox()
    with tempfile.TemporaryDirectory() as folder, stage("import", "check that the solid is valid"):
        path = Path(folder) / "part.brep"
        part.write_brep(path)
        solid = occ.importShapes(str(path))
        if not whole:
            extent = (box.xlen + 2.0, box.ymax + 1.0, box.zlen + 2.0)
            keep = occ.addBox(box.xmin - 1.0, 0.0, box.zmin - 1.0, *extent)
            occ.intersect(solid, [(3, keep)])
        occ.synchronize()
        # Areas and centres are taken before the half is flattened.
        surfaces = {tag: (occ.getMass(2, tag), occ.getCenterOfMass(2, tag)) for _, tag in gmsh.model.getEntities(2)}
        # The mesh of the flattened half is stretched back later. Its elements are long over the depth, along which the
        # displacements change slowly.
        occ.dilate(gmsh.model.getEntities(3), 0.0, 0.0, 0.0, 1.0, 1.0 / _STRETCH, 1.0)
        occ.synchronize()
    if whole:  # gmsh reads the faces in their order
        tags = list(surfaces)
        return {name: [tags[index] for index in indices] for name, indices in part.faces.items()}
    found = {}
    for name, indices in part.faces.items():
        if name != "side_faces":  # the plane y = 0 does not halve side faces; one of the two is in this half
            found[name] = [_half_face(part, index, surfaces) for index in indices]
    in_plane = [tag for tag, (_, centre) in surfaces.items() if abs(centre[1]) < _NEAR]
    if not in_plane:
        raise MeshError("import", "no face lies in the plane y = 0", "the part must be symmetric about it")
    return {**found, "symmetry": in_plane}


def _half_face(part: Part, index: int, surfaces: dict[int, tuple[float, tuple[float, float, float]]]) -> int:
    """Return the tag of the surface that is half of a face of the part: equal x and z of the centre, half the area.

    `surfaces` holds area [mm^2] and centre [mm] by tag. Raises MeshError unless exactly one surface matches.
    """
    face = part.shape.Faces()[index]
    place, area = face.Center(), face.Area()
    hits = [
        tag
        for tag, (mass, (x, _, z)) in surfaces.items()
        if np.hypot(x - place.x, z - place.z) < _NEAR and abs(2.0 * mass - area) < _NEAR * area
    ]
    if len(hits) != 1:
        reason = f"face {index} of part {part.name!r} has {len(hits)} halves"
        raise MeshError("names", reason, "the part must be symmetric about the plane y = 0")
    return hits[0]


def _set_sizes(part: Part, boxes: Sequence[Box], size: float) -> None:
    """Set the element sizes in gmsh: the least of all boxes, where the size of each grows to the size of the frame."""
    field = gmsh.model.mesh.field
    box_of_part = part.shape.BoundingBox()
    depth = max(box_of_part.ymax, -box_of_part.ymin) / _STRETCH
    with stage("size", "check the sizes"):
        tags = []
        for box in boxes:
            tag = field.add("Box")
            x0, z0, x1, z1 = box.corners
            numbers = {"XMin": x0, "XMax": x1, "YMin": -depth, "YMax": depth, "ZMin": z0, "ZMax": z1,
                       "VIn": box.size, "VOut": _FRAME * size, "Thickness": _REACH}  # fmt: skip
            for name, value in numbers.items():
                field.setNumber(tag, name, value)
            tags.append(tag)
        least = field.add("Min")
        field.setNumbers(least, "FieldsList", tags)
        field.setAsBackgroundMesh(least)


def _read(names: dict[str, list[int]]) -> MeshTet2:
    """Return the mesh generated by gmsh, stretched back to the true depth, with named surfaces as boundaries."""
    tags = element_nodes("Tetrahedron", 2)
    corners, edges = used_nodes(tags[:4]), used_nodes(tags[4:])
    stretch = np.array([[1.0], [_STRETCH], [1.0]])
    straight = MeshTet1(corners.points * stretch, np.ascontiguousarray(corners.index[tags[:4]]))
    mesh = MeshTet2.from_mesh(straight)
    # Midpoints of edges are moved from gmsh's numbering to scikit-fem's by the ends of the edges.
    ends = np.concatenate([corners.index[tags[list(pair)]] for pair in _PAIRS], axis=1)
    place = index_by_nodes(straight.edges, ends).reshape(len(_PAIRS), -1)
    curved = mesh.doflocs.copy()
    curved[:, corners.points.shape[1] + place] = (edges.points * stretch)[:, edges.index[tags[4:]]]
    moved = _unfolded(MeshTet2(curved, mesh.t), mesh)
    boundaries = {}
    for name, surfaces in names.items():
        triangles = np.hstack([corners.index[element_nodes("Triangle", 2, tag)[:3]] for tag in surfaces])
        boundaries[name] = index_by_nodes(straight.facets, triangles)
    return moved.with_boundaries(boundaries)


def _unfolded(curved: MeshTet2, straight: MeshTet2) -> MeshTet2:
    """Return the mesh with straight edges on folded elements; curving may fold a few of them."""
    for _ in range(_UNFOLDINGS):
        folded = _folded(curved)
        if not len(folded):
            break
        places = curved.doflocs.copy()
        corners = straight.t.max() + 1
        edges = corners + straight.t2e[:, folded]
        places[:, edges] = straight.doflocs[:, edges]
        curved = MeshTet2(places, straight.t)
    return curved


def _folded(mesh: MeshTet2) -> Ints:
    """Return the elements whose Jacobian determinant changes its sign or vanishes at corners or quadrature points."""
    jacobian = mesh.mapping().detDF(np.hstack([RefTet.p, get_quadrature(RefTet, 4)[0]]))
    return np.flatnonzero(jacobian.min(axis=1) * jacobian.max(axis=1) <= 0.0)


def _check(mesh: MeshTet2, volume: float, tolerance: float) -> None:
    """Raise MeshError if an element is folded, or if the volume of the mesh is not the expected one [mm^3]."""
    folded = len(_folded(mesh))
    if folded:
        raise MeshError("quality", f"{folded} curved tetrahedra are folded", "take smaller elements")
    points, weights = get_quadrature(RefTet, 4)
    meshed = float((np.abs(mesh.mapping().detDF(points)) * weights).sum())
    compare("volume", meshed, volume, tolerance, "take smaller elements on curved faces")
