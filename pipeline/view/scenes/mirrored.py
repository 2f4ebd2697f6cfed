"""A half model mirrored at its plane of symmetry y = 0 to the whole."""

from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

Mesh = Any  # a PyVista data set: its decorated methods have no types that strict mode takes

SYMMETRY = "symmetry"
"""The mark of the nodes on the plane of symmetry; a mesh without it is whole."""

# A mirror turns a cell inside out: its nodes in the order that VTK's figures give a cell seen from the other side.
_HEXA = (0, 3, 2, 1, 4, 7, 6, 5)
_EDGES = (11, 10, 9, 8, 15, 14, 13, 12, 16, 19, 18, 17)
_ORDERS = {int(pv.CellType.HEXAHEDRON): _HEXA, int(pv.CellType.QUADRATIC_HEXAHEDRON): (*_HEXA, *_EDGES)}
# What changes its sign at the plane y = 0, by the number of components.
_SIGNS = {1: (1.0,), 3: (1.0, -1.0, 1.0), 6: (1.0, 1.0, 1.0, -1.0, -1.0, 1.0)}


def whole_model(mesh: Mesh) -> Mesh:
    """Return the whole of a mesh [mm] with its arrays: a half model and its mirror image, anything else as it is.

    Six components are those of a symmetric tensor, xx, yy, zz, xy, yz, xz.
    """
    if SYMMETRY not in mesh.point_data:
        return mesh
    off_plane = np.flatnonzero(np.asarray(mesh.point_data[SYMMETRY]) == 0)
    image = np.arange(mesh.n_points)
    image[off_plane] = mesh.n_points + np.arange(len(off_plane))
    points = np.asarray(mesh.points)
    cells = {
        kind: np.concatenate([nodes, image[nodes[:, _ORDERS[int(kind)]]]]) for kind, nodes in mesh.cells_dict.items()
    }
    whole = pv.UnstructuredGrid(cells, _with_image(points, off_plane))
    for name in mesh.point_data:
        if name != SYMMETRY:
            whole.point_data[name] = _with_image(np.asarray(mesh.point_data[name]), off_plane)
    return whole


def _with_image(values: NDArray[Any], nodes: NDArray[np.int64]) -> NDArray[Any]:
    """Return values at all nodes of the half, then at the images of some."""
    components = 1 if values.ndim == 1 else values.shape[1]
    signs = np.array(_SIGNS[components], dtype=values.dtype)
    mirrored = values[nodes] * (signs[0] if values.ndim == 1 else signs)
    return np.concatenate([values, mirrored])
