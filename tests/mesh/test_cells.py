"""Cells and their facets against scikit-fem's own mapping, on bent meshes of every kind that is solved on."""

from dataclasses import replace

import numpy as np
import pytest
from skfem import ElementHex2, ElementHexS2, ElementTetP2, FacetBasis, MeshHex2, MeshTet2

from mesh.cells import cell_jacobian, cell_points, determinant, facets_area, gradients, inverse, shape_table

EXACT = 1e-12  # round-off of sums over 27 nodes


def bent(mesh):
    x, y, z = mesh.doflocs
    return replace(mesh, doflocs=np.stack([x + 0.1 * y * z, y + 0.2 * x**2, z - 0.1 * np.sin(x + y)]))


CASES = [
    (MeshHex2().refined(1), ElementHex2()),
    (MeshHex2().refined(1), ElementHexS2()),
    (MeshTet2().refined(1), ElementTetP2()),
]


@pytest.mark.parametrize(("mesh", "element"), CASES)
@pytest.mark.parametrize("own", [False, True])
def test_map_and_gradients_are_those_of_scikit_fem(mesh, element, own, rng):
    mesh, cells = bent(mesh), np.array([3, 0, 5])
    points = rng.uniform(0.0, 0.3, (3, len(cells), 4) if own else (3, 4))
    mapping, slopes = mesh.mapping(), cell_jacobian(mesh, points, cells)
    table = shape_table(element, points)
    stock = [element.gbasis(mapping, points, node, tind=cells)[0] for node in range(len(element.doflocs))]
    assert cell_points(mesh, points, cells) == pytest.approx(mapping.F(points, tind=cells), abs=EXACT)
    assert slopes == pytest.approx(mapping.DF(points, tind=cells), abs=EXACT)
    assert determinant(slopes) == pytest.approx(mapping.detDF(points, tind=cells), abs=EXACT)
    assert inverse(slopes) == pytest.approx(mapping.invDF(points, tind=cells), rel=EXACT, abs=EXACT)
    assert gradients(table, slopes) == pytest.approx(np.stack([np.asarray(one.grad) for one in stock]), abs=1e-11)
    shapes = table.values if own else table.values[:, None, :]
    assert np.broadcast_to(shapes, (len(stock), 3, 4)) == pytest.approx(np.stack([np.asarray(one) for one in stock]))


def test_area_of_bent_facets_is_that_of_scikit_fem():
    mesh = bent(CASES[0][0])
    facets = mesh.boundary_facets()
    stock = FacetBasis(mesh, ElementHex2(), facets=facets, intorder=5).dx.sum()
    assert facets_area(mesh, facets) == pytest.approx(stock, rel=EXACT)
    assert facets_area(mesh, facets[1:]) < facets_area(mesh, facets)
