"""The mesh of a part that is no extrusion: quadratic tetrahedra with curved edges, small where a wall is thin."""

import dataclasses
import os
from pathlib import Path
from typing import TYPE_CHECKING

import gmsh
import numpy as np
from skfem import MeshTet1, MeshTet2
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTet

from mesh.cells import cell_jacobian, determinant
from mesh.own_part import GradedSizes
from mesh.session import Ints, MeshError, element_nodes, gmsh_session, index_by_nodes, stage, used_nodes
from sensor.arrays import Floats

if TYPE_CHECKING:
    from cad.checks.own_part import Walls
    from cad.parts.part import Part

_HINT = "check the solid at its smallest faces"
_GROWTH = 0.5  # growth of the element size per distance
_LARGEST_SHARE = 0.15  # largest element over the longest side of the part


def tetrahedra(part: "Part", walls: "Walls", scale: float) -> MeshTet2:
    """Return the mesh [mm] of a part with its named faces; at `scale` 1 an element is as large as a wall is thick.

    Raises MeshError with the stage that failed.
    """
    sizes = GradedSizes(walls.points, scale * walls.sizes, _GROWTH)
    largest = _LARGEST_SHARE * float(np.ptp(walls.points, axis=1).max())

    def size_at(dim: int, _tag: int, at_x: float, at_y: float, at_z: float, size: float) -> float:
        if dim > 2:  # noqa: PLR2004 - inside, gmsh takes the sizes of the surface
            return size
        return min(largest, sizes.at(at_x, at_y, at_z))

    with gmsh_session():
        with os.fdopen(os.memfd_create("part.brep")) as in_memory, stage("import", _HINT):
            path = Path(f"/proc/self/fd/{in_memory.fileno()}")
            part.write_brep(path)
            gmsh.model.occ.importShapes(str(path), format="brep")
            gmsh.model.occ.synchronize()
            tags = [tag for _, tag in gmsh.model.getEntities(2)]
        with stage("generate", _HINT):
            gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 1.0)
            gmsh.model.mesh.setSizeCallback(size_at)
            gmsh.model.mesh.generate(3)
            gmsh.model.mesh.setOrder(2)
        with stage("read", _HINT):
            cells = element_nodes("Tetrahedron", 2)
            nodes = used_nodes(cells)
            faces = {
                name: np.hstack([element_nodes("Triangle", 2, tags[place])[:3] for place in places])
                for name, places in part.faces.items()
            }
    return _curved(nodes.points, nodes.index[cells], {name: nodes.index[found] for name, found in faces.items()})


def _curved(points: Floats, cells: Ints, faces: dict[str, Ints]) -> MeshTet2:
    """Return the mesh from gmsh's ten nodes of each cell, with straight edges where curved ones would fold it."""
    corners, places = np.unique(cells[:4], return_inverse=True)
    new = np.full(points.shape[1], -1, dtype=np.int64)
    new[corners] = np.arange(len(corners))
    straight = MeshTet1(np.ascontiguousarray(points[:, corners]), places.reshape(4, -1))
    boundaries = {}
    for name, triangles in faces.items():
        boundaries[name] = index_by_nodes(straight.facets, new[triangles])
    mesh = MeshTet2.from_mesh(straight)
    ends = new[np.hstack([cells[[0, 1]], cells[[1, 2]], cells[[2, 0]], cells[[3, 0]], cells[[2, 3]], cells[[1, 3]]])]
    middles = np.concatenate([cells[row] for row in range(4, 10)])
    edge = index_by_nodes(straight.edges, ends)
    nodes = mesh.doflocs.copy()
    count = len(corners)
    nodes[:, count + edge] = points[:, middles]
    straight_nodes = mesh.doflocs
    for _ in range(3):
        bent = dataclasses.replace(mesh, doflocs=nodes)
        jacobian = cell_jacobian(bent, np.hstack([RefTet.p, get_quadrature(RefTet, 4)[0]]))
        sign = determinant(jacobian)
        folded = np.flatnonzero((sign * np.sign(sign[:, -1:])).min(axis=1) <= 0.0)
        if not len(folded):
            return bent.with_boundaries(boundaries)
        loose = np.unique(count + straight.t2e[:, folded])
        nodes[:, loose] = straight_nodes[:, loose]
    raise MeshError("quality", f"{len(folded)} tetrahedra are folded", _HINT)
