"""Arrays of gmsh's nodes and elements, and the facets and edges of a mesh by their nodes."""

from dataclasses import dataclass

import gmsh
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Nodes:
    """Positions of nodes (3, n) [mm], and the index of each tag of gmsh among them, -1 for a tag that is not used."""

    points: Floats
    index: Ints


def element_nodes(kind: str, order: int = 1, entity: int = -1) -> Ints:
    """Return gmsh's tags of the nodes of all elements of a kind, or of those on one entity, shape (nodes, elements)."""
    number = gmsh.model.mesh.getElementType(kind, order)
    count = gmsh.model.mesh.getElementProperties(number)[3]
    nodes = gmsh.model.mesh.getElementsByType(number, entity)[1]
    return np.asarray(nodes, dtype=np.int64).reshape(-1, count).T


def used_nodes(elements: Ints) -> Nodes:
    """Return the nodes that elements use, of shape (nodes, elements), in the order of their tags."""
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    used = np.unique(elements)
    index = np.full(int(np.max(tags)) + 1, -1, dtype=np.int64)
    index[used] = np.arange(len(used))
    order = np.empty_like(index)
    order[np.asarray(tags, dtype=np.int64)] = np.arange(len(tags))
    return Nodes(np.ascontiguousarray(np.reshape(coordinates, (-1, 3))[order[used]].T), index)


def index_by_nodes(columns: Ints, wanted: Ints) -> Ints:
    """Return the one of `columns` that has the nodes of each column of `wanted`, shape (k,), -1 where none has.

    Facets or edges by their nodes, (nodes, n) and (nodes, k), which may stand in any order.
    """
    nodes = np.sort(np.concatenate([columns, wanted], axis=1), axis=0)
    _, label = np.unique(nodes, axis=1, return_inverse=True)
    column = np.full(nodes.shape[1], -1, dtype=np.int64)
    column[label[: columns.shape[1]]] = np.arange(columns.shape[1])
    return np.asarray(column[label[columns.shape[1] :]])
