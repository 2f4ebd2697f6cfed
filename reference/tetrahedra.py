"""Meshes of a housing in curved quadratic tetrahedra, for an independent check of its stiffness.

Only the names of faces are shared with the swept mesh of the product. The solid may come from a STEP file.
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
    """A box (x0, z0, x1, z1) through the whole depth of the part [mm], with the element size inside [mm]."""

    corners: tuple[float, float, float, float]
    size: float


def fine_boxes(housing: Housing, size: float) -> list[Box]:
    """Return the boxes of small elements around leaves, roots and tips; `size` scales all element sizes [1]."""
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


def tetrahedra(part: Part, boxes: Sequence[Box], size: float, *, tolerance: float) -> MeshTet2:
    """Return the mesh [mm] of a part, with its named faces as boundaries.

    `boxes` are the regions of small elements, and `size` scales all other elements [1]. `tolerance` is the largest
    relative difference between the volumes of mesh and part [1]. Raises MeshError, which names the stage that failed.
    """
    with gmsh_session():
        with stage("size", "check the sizes"):
            # Second order puts the midpoints of edges on arcs too; `_read_mesh` copies them to scikit-fem's mesh.
            gmsh.option.setNumber("Mesh.ElementOrder", 2.0)
            gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", _AROUND / size)
        surfaces = _import_part(part)
        _set_sizes(part, boxes, size)
        with stage("generate", "take smaller elements, or check the solid"):
            gmsh.model.mesh.generate(3)
        with stage("read", "check the solid"):
            mesh = _read_mesh(surfaces)
    _check_mesh(mesh, float(part.shape.Volume()), tolerance)
    return mesh


def _import_part(part: Part) -> dict[str, list[int]]:
    """Load a part into gmsh, compressed along y; return the tags of its surfaces by the name of the face."""
    occ = gmsh.model.occ
    with tempfile.TemporaryDirectory() as folder, stage("import", "check that the solid is valid"):
        path = Path(folder) / "part.brep"
        part.write_brep(path)
        occ.importShapes(str(path))
        occ.synchronize()
        # `_read_mesh` stretches the mesh back. Its elements are then long along the depth, where displacements change
        # slowly.
        occ.dilate(gmsh.model.getEntities(3), 0.0, 0.0, 0.0, 1.0, 1.0 / _STRETCH, 1.0)
        occ.synchronize()
    tags = [tag for _, tag in gmsh.model.getEntities(2)]  # gmsh reads faces in the order of the part
    return {name: [tags[index] for index in indices] for name, indices in part.faces.items()}


def _set_sizes(part: Part, boxes: Sequence[Box], size: float) -> None:
    """Set the element sizes in gmsh: inside each box its own size, which grows to the size of the frame outside.

    Where several boxes overlap, the smallest size counts.
    """
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
        minimum = field.add("Min")
        field.setNumbers(minimum, "FieldsList", tags)
        field.setAsBackgroundMesh(minimum)


def _read_mesh(surfaces: dict[str, list[int]]) -> MeshTet2:
    """Return the mesh that gmsh generated, stretched back to the true depth, with the named surfaces as boundaries."""
    tags = element_nodes("Tetrahedron", 2)
    corners, edges = used_nodes(tags[:4]), used_nodes(tags[4:])
    stretch = np.array([[1.0], [_STRETCH], [1.0]])
    straight = MeshTet1(corners.points * stretch, np.ascontiguousarray(corners.index[tags[:4]]))
    mesh = MeshTet2.from_mesh(straight)
    # gmsh and scikit-fem number the edges differently, so each midpoint is found by the two ends of its edge.
    ends = np.concatenate([corners.index[tags[list(pair)]] for pair in _PAIRS], axis=1)
    place = index_by_nodes(straight.edges, ends).reshape(len(_PAIRS), -1)
    curved = mesh.doflocs.copy()
    curved[:, corners.points.shape[1] + place] = (edges.points * stretch)[:, edges.index[tags[4:]]]
    boundaries = {}
    for name, of_face in surfaces.items():
        triangles = np.hstack([corners.index[element_nodes("Triangle", 2, tag)[:3]] for tag in of_face])
        boundaries[name] = index_by_nodes(straight.facets, triangles)
    return _straighten_folded(MeshTet2(curved, mesh.t), mesh).with_boundaries(boundaries)


def _straighten_folded(curved: MeshTet2, straight: MeshTet2) -> MeshTet2:
    """Return the curved mesh with straight edges on its folded elements.

    An edge is shared by several elements, so straightening it may fold a neighbour; `_UNFOLDINGS` passes are made.
    """
    for _ in range(_UNFOLDINGS):
        folded = _folded_elements(curved)
        if not len(folded):
            break
        nodes = curved.doflocs.copy()
        corner_count = straight.t.max() + 1  # the midpoints of edges are numbered after the corners
        midpoints = corner_count + straight.t2e[:, folded]
        nodes[:, midpoints] = straight.doflocs[:, midpoints]
        curved = MeshTet2(nodes, straight.t)
    return curved


def _folded_elements(mesh: MeshTet2) -> Ints:
    """Return the indices of elements whose Jacobian determinant vanishes or changes sign.

    The determinant is taken at the corners and at the quadrature points.
    """
    determinants = mesh.mapping().detDF(np.hstack([RefTet.p, get_quadrature(RefTet, 4)[0]]))
    return np.flatnonzero(determinants.min(axis=1) * determinants.max(axis=1) <= 0.0)


def _check_mesh(mesh: MeshTet2, volume: float, tolerance: float) -> None:
    """Raise MeshError if an element is folded, or if the volume of the mesh is not the expected one [mm^3]."""
    folded = len(_folded_elements(mesh))
    if folded:
        raise MeshError("quality", f"{folded} curved tetrahedra are folded", "take smaller elements")
    points, weights = get_quadrature(RefTet, 4)
    meshed = float((np.abs(mesh.mapping().detDF(points)) * weights).sum())
    compare("volume", meshed, volume, tolerance, "take smaller elements on curved faces")
