"""Meshes of a housing with curved quadratic tetrahedra, for an independent check of its stiffness.

These meshes have only the names of faces in common with the swept mesh of the product. The solid may come from a STEP
file.
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

_STRETCH = 3.0  # ratio of the element size along the depth to the size in the plane of the plate
_MAX_PASSES = 3  # number of passes that straighten folded elements
# Element sizes at the relative size 1.
_FRAME_SIZE_MM = 3.0  # size away from the leaves
_LEAF_SIZE_RATIO = 0.6  # ratio of the size in a leaf to the thickness of the leaf
_TIP_SIZE_RATIO = 0.5  # ratio of the size at a tip to the side of the tip
_ROOT_SIZE_RATIO = 0.4  # ratio of the size at a leaf root to the radius of its fillet
_ELEMENTS_PER_CIRCLE = 14.0  # number of elements around a full circle; if there are fewer, curving may fold them
_TRANSITION_MM = 6.0  # distance over which the size increases from a box to the frame
_EDGES = ((0, 1), (1, 2), (2, 0), (3, 0), (2, 3), (1, 3))  # corners at the ends of gmsh's edge nodes 4 to 9


@dataclass(frozen=True, kw_only=True)
class Box:
    """A box with small elements, which extends through the whole depth of the part.

    `corners` are x0, z0, x1 and z1 [mm], and `size` is the element size in the box [mm].
    """

    corners: tuple[float, float, float, float]
    size: float


def fine_boxes(housing: Housing, size: float) -> list[Box]:
    """Return boxes of small elements around the leaves, their roots and the tips.

    `size` [1] multiplies all element sizes.
    """
    boxes = []
    for arm in housing.arms:
        thickness = arm.flexure.thickness
        fillet = arm.flexure.fillet
        left, right = arm.roots  # x coordinates of the ends of the leaves
        for level in arm.levels:  # z coordinate of the mid-plane of each leaf
            bottom = level - 0.5 * thickness
            top = level + 0.5 * thickness
            boxes.append(Box(corners=(left, bottom, right, top), size=_LEAF_SIZE_RATIO * size * thickness))
            for x in (left, right):
                corners = (x - fillet, bottom - fillet, x + fillet, top + fillet)
                boxes.append(Box(corners=corners, size=_ROOT_SIZE_RATIO * size * fillet))
    half_side = 0.5 * housing.tip_side
    for x in (-0.5 * housing.spacing, 0.5 * housing.spacing):
        # The box extends from the face of the tip to twice its height, so it includes material behind the tip.
        corners = (x - half_side, 0.0, x + half_side, 2.0 * housing.tip_height)
        boxes.append(Box(corners=corners, size=_TIP_SIZE_RATIO * size * housing.tip_side))
    return boxes


def tetrahedra(part: Part, boxes: Sequence[Box], size: float, *, tolerance: float) -> MeshTet2:
    """Divide a part into curved quadratic tetrahedra [mm], with its named faces as boundaries.

    `boxes` are the regions of small elements, and `size` [1] multiplies the size of all other elements. `tolerance` [1]
    is the largest allowed relative difference in volume between the mesh and the part. Raises MeshError if an element
    is folded or the volume differs by more, and MachineError if gmsh fails.
    """
    with gmsh_session():
        with stage("size", "check the sizes"):
            # With second order, gmsh places the edge nodes on curved faces. `_read_mesh` copies them.
            gmsh.option.setNumber("Mesh.ElementOrder", 2.0)
            gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", _ELEMENTS_PER_CIRCLE / size)
        surfaces = _import_part(part)
        _set_sizes(part, boxes, size)
        with stage("generate", "use smaller elements, or check the solid"):
            gmsh.model.mesh.generate(3)
        with stage("read", "check the solid"):
            mesh = _read_mesh(surfaces)
    _check_mesh(mesh, float(part.shape.Volume()), tolerance)
    return mesh


def _import_part(part: Part) -> dict[str, list[int]]:
    """Load a part into gmsh, compress it along y, and return the tags of its surfaces by the name of the face.

    gmsh makes elements of about equal size in all directions. Compressing the part before meshing, and stretching the
    mesh afterwards (`_read_mesh`), makes the elements longer along the depth. Displacements change slowly there.
    """
    occ = gmsh.model.occ
    with tempfile.TemporaryDirectory() as folder, stage("import", "check that the solid is valid"):
        path = Path(folder) / "part.brep"
        part.write_brep(path)
        occ.importShapes(str(path))
        occ.synchronize()
        occ.dilate(gmsh.model.getEntities(3), 0.0, 0.0, 0.0, 1.0, 1.0 / _STRETCH, 1.0)
        occ.synchronize()
    tags = [tag for _, tag in gmsh.model.getEntities(2)]  # gmsh reads faces in the order of the part
    return {name: [tags[index] for index in indices] for name, indices in part.faces.items()}


def _set_sizes(part: Part, boxes: Sequence[Box], size: float) -> None:
    """Set the element sizes in gmsh: the size of each box inside it, increasing to the size of the frame outside.

    `size` [1] multiplies the size in the frame. If boxes overlap, the smallest size applies.
    """
    field = gmsh.model.mesh.field
    part_bounds = part.shape.BoundingBox()
    depth = max(part_bounds.ymax, -part_bounds.ymin) / _STRETCH  # largest |y| of the compressed part
    with stage("size", "check the sizes"):
        tags = []
        for box in boxes:
            tag = field.add("Box")
            x0, z0, x1, z1 = box.corners
            limits = {"XMin": x0, "XMax": x1, "YMin": -depth, "YMax": depth, "ZMin": z0, "ZMax": z1}
            sizes = {"VIn": box.size, "VOut": _FRAME_SIZE_MM * size, "Thickness": _TRANSITION_MM}
            for option, value in {**limits, **sizes}.items():
                field.setNumber(tag, option, value)
            tags.append(tag)
        minimum = field.add("Min")
        field.setNumbers(minimum, "FieldsList", tags)
        field.setAsBackgroundMesh(minimum)


def _read_mesh(surfaces: dict[str, list[int]]) -> MeshTet2:
    """Read the mesh from gmsh, stretch it back to the true depth, and name its boundaries.

    `surfaces` maps the names of faces to gmsh's surface tags. Folded elements are straightened.
    """
    tags = element_nodes("Tetrahedron", 2)  # node tags (10, elements): four corners, then six midside nodes
    corners, midside = used_nodes(tags[:4]), used_nodes(tags[4:])
    stretch = np.array([[1.0], [_STRETCH], [1.0]])
    linear_mesh = MeshTet1(corners.points * stretch, np.ascontiguousarray(corners.index[tags[:4]]))
    straight_mesh = MeshTet2.from_mesh(linear_mesh)
    # gmsh and scikit-fem number the edges differently, so each midside node is assigned by the two ends of its edge.
    edge_ends = np.concatenate([corners.index[tags[list(pair)]] for pair in _EDGES], axis=1)
    edge = index_by_nodes(linear_mesh.edges, edge_ends).reshape(len(_EDGES), -1)
    nodes = straight_mesh.doflocs.copy()
    # In scikit-fem, the midside nodes follow the corners, in the order of the edges.
    corner_count = corners.points.shape[1]
    nodes[:, corner_count + edge] = (midside.points * stretch)[:, midside.index[tags[4:]]]
    curved_mesh = MeshTet2(nodes, straight_mesh.t)
    boundaries = _boundary_facets(surfaces, linear_mesh, corners.index)
    return _straighten_folded(curved_mesh, straight_mesh).with_boundaries(boundaries)


def _boundary_facets(surfaces: dict[str, list[int]], mesh: MeshTet1, corner_index: Ints) -> dict[str, Ints]:
    """Return the indices of the mesh facets on each named face.

    `surfaces` maps the names of faces to gmsh's surface tags, and `corner_index` maps gmsh's node tags to the corners
    of the mesh.
    """
    boundaries = {}
    for name, surface_tags in surfaces.items():
        # The first three nodes of a quadratic triangle are its corners.
        triangles = np.hstack([corner_index[element_nodes("Triangle", 2, tag)[:3]] for tag in surface_tags])
        boundaries[name] = index_by_nodes(mesh.facets, triangles)
    return boundaries


def _straighten_folded(curved: MeshTet2, straight: MeshTet2) -> MeshTet2:
    """Return a curved mesh whose folded elements have straight edges.

    `straight` is the same mesh with straight edges. An edge belongs to several elements, so straightening it may fold
    another one. The mesh is therefore checked again, up to `_MAX_PASSES` times. Elements may remain folded.
    """
    for _ in range(_MAX_PASSES):
        folded = _folded_elements(curved)
        if not len(folded):
            break
        nodes = curved.doflocs.copy()
        corner_count = straight.t.max() + 1  # midside nodes are numbered after the corners
        midside = corner_count + straight.t2e[:, folded]
        nodes[:, midside] = straight.doflocs[:, midside]
        curved = MeshTet2(nodes, straight.t)
    return curved


def _folded_elements(mesh: MeshTet2) -> Ints:
    """Return the indices of elements whose Jacobian determinant vanishes or changes sign.

    The determinant is evaluated at the corners and at the quadrature points.
    """
    determinants = mesh.mapping().detDF(np.hstack([RefTet.p, get_quadrature(RefTet, 4)[0]]))
    return np.flatnonzero(determinants.min(axis=1) * determinants.max(axis=1) <= 0.0)


def _check_mesh(mesh: MeshTet2, volume: float, tolerance: float) -> None:
    """Raise MeshError if an element is folded, or if the mesh does not have the expected volume [mm^3].

    `tolerance` [1] is the allowed relative difference in volume.
    """
    folded_count = len(_folded_elements(mesh))
    if folded_count:
        raise MeshError("quality", f"{folded_count} curved tetrahedra are folded", "use smaller elements")
    points, weights = get_quadrature(RefTet, 4)
    mesh_volume = float((np.abs(mesh.mapping().detDF(points)) * weights).sum())
    compare("volume", mesh_volume, volume, tolerance, "use smaller elements on curved faces")
