"""The mesh of a part that is not an extrusion: quadratic tetrahedra with curved edges.

The elements are small where a wall is thin.
"""

import dataclasses
from typing import TYPE_CHECKING

import gmsh
import numpy as np
from skfem import MeshTet1, MeshTet2
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTet

from mesh.cells import cell_jacobian, determinant
from mesh.own_part import GradedSizes
from mesh.session import (
    SURFACE,
    Ints,
    MeshError,
    element_nodes,
    gmsh_session,
    import_brep,
    index_by_nodes,
    stage,
    used_nodes,
)
from sensor.arrays import Floats

if TYPE_CHECKING:
    from cad.checks.own_part import Walls
    from cad.parts.part import Part

_HINT = "check the solid at its smallest faces"
_GROWTH = 0.5  # growth of the element size with distance from a thin wall [mm per mm]
_LARGEST_SIZE_FRACTION = 0.15  # largest element size as a fraction of the longest side of the part
# Maximum number of searches for folded cells. One search may not be enough, because straightening an edge of a folded
# cell may fold another cell.
_MAX_PASSES = 3


def tetrahedral_mesh(part: "Part", walls: "Walls", scale: float) -> MeshTet2:
    """Divide a part into quadratic tetrahedra [mm], with the part's named faces as boundaries.

    `walls` holds points on the surface and the element size that wall thickness and curvature require at each. The
    sizes are multiplied by `scale` [1]. At scale 1, an element is as large as the wall is thick. Raises MeshError if
    cells remain folded, and MachineError if gmsh fails.
    """
    sizes = GradedSizes(walls.points, scale * walls.sizes, _GROWTH)
    largest_size = _LARGEST_SIZE_FRACTION * float(np.ptp(walls.points, axis=1).max())

    def size_at(dimension: int, _tag: int, x: float, y: float, z: float, default_size: float) -> float:
        """Return the element size [mm] that gmsh requests at a position on an entity of this dimension."""
        if dimension > SURFACE:  # in the volume, gmsh by default interpolates the sizes on the surface
            return default_size
        return min(largest_size, sizes.at(x, y, z))

    with gmsh_session():
        import_brep(part.write_brep, _HINT)
        with stage("import", _HINT):
            gmsh.model.occ.synchronize()
            tags = [tag for _, tag in gmsh.model.getEntities(SURFACE)]  # in the order of the part's faces
        with stage("generate", _HINT):
            gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 1.0)  # sizes in the volume follow the surface
            gmsh.model.mesh.setSizeCallback(size_at)
            gmsh.model.mesh.generate(3)
            gmsh.model.mesh.setOrder(2)
        with stage("read", _HINT):
            cells = element_nodes("Tetrahedron", 2)
            nodes = used_nodes(cells)
            faces = {}
            for name, indices in part.faces.items():
                faces[name] = nodes.index[_corners_of_triangles([tags[i] for i in indices])]
    return _quadratic_mesh(nodes.points, nodes.index[cells], faces)


def _corners_of_triangles(surfaces: list[int]) -> Ints:
    """Return gmsh's node tags (3, k) at the corners of the quadratic triangles on surfaces with these gmsh tags."""
    # The first three of the six nodes of a quadratic triangle are its corners.
    return np.hstack([element_nodes("Triangle", 2, surface)[:3] for surface in surfaces])


def _quadratic_mesh(points: Floats, cells: Ints, faces: dict[str, Ints]) -> MeshTet2:
    """Convert gmsh's quadratic tetrahedra to a scikit-fem mesh, and straighten the edges of folded cells.

    `points` (3, n) [mm] are gmsh's nodes. `cells` (10, m) holds the node indices of each cell, its four corners first.
    `faces` holds the corner indices (3, k) of the triangles on each named face. Raises MeshError if cells are still
    folded after `_MAX_PASSES` passes.
    """
    # scikit-fem numbers the corners from 0 without gaps, followed by one node at the middle of each edge.
    corners, corner_index = np.unique(cells[:4], return_inverse=True)
    new_index = np.full(points.shape[1], -1, dtype=np.int64)  # the new number of each corner, and -1 of other nodes
    new_index[corners] = np.arange(len(corners))
    straight = MeshTet1(np.ascontiguousarray(points[:, corners]), corner_index.reshape(4, -1))
    boundaries = {}
    for name, triangles in faces.items():
        boundaries[name] = index_by_nodes(straight.facets, new_index[triangles])
    straight_quadratic = MeshTet2.from_mesh(straight)

    # Each of gmsh's midside nodes replaces scikit-fem's node on the edge with the same ends. In gmsh, nodes 4 to 9 of a
    # cell are the midside nodes of the edges between these corners, in this order.
    edges_of_cell = [cells[[0, 1]], cells[[1, 2]], cells[[2, 0]], cells[[3, 0]], cells[[2, 3]], cells[[1, 3]]]
    edge_ends = new_index[np.hstack(edges_of_cell)]
    midside_nodes = np.concatenate([cells[row] for row in range(4, 10)])
    edge = index_by_nodes(straight.edges, edge_ends)
    curved_nodes = straight_quadratic.doflocs.copy()
    curved_nodes[:, len(corners) + edge] = points[:, midside_nodes]
    return _straighten_folded_cells(straight_quadratic, curved_nodes).with_boundaries(boundaries)


def _straighten_folded_cells(straight: MeshTet2, curved_nodes: Floats) -> MeshTet2:
    """Return the mesh with curved edges, except that the edges of folded cells are straight.

    `straight` has straight edges only, and `curved_nodes` (3, n) [mm] are its nodes after curving. A cell is folded if
    the determinant of its Jacobian changes sign. Raises MeshError if cells are still folded after `_MAX_PASSES` passes.
    """
    # The determinant is sampled at the corners and at quadrature points. A cell is folded if the sign at any of these
    # points differs from the sign at the last one.
    sample_points = np.hstack([RefTet.p, get_quadrature(RefTet, 4)[0]])
    corner_count = straight.nvertices  # the nodes of edges are numbered after the corners
    nodes = curved_nodes.copy()
    for _ in range(_MAX_PASSES):
        curved = dataclasses.replace(straight, doflocs=nodes)
        determinants = determinant(cell_jacobian(curved, sample_points))  # (cells, sample points)
        folded = np.flatnonzero((determinants * np.sign(determinants[:, -1:])).min(axis=1) <= 0.0)
        if not len(folded):
            return curved
        folded_edges = np.unique(corner_count + straight.t2e[:, folded])
        nodes[:, folded_edges] = straight.doflocs[:, folded_edges]
    raise MeshError("quality", f"{len(folded)} tetrahedra are folded", _HINT)
