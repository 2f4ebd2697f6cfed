"""Layers between the frame and the ground: their area, their give, and what they must not be."""

import math

import numpy as np
import pytest
from skfem import ElementHexS2, MeshHex1, MeshHex2

from solve.elasticity import stiffness_matrix, vector_basis
from solve.housing.elastic_layer import ElasticLayer, layer_matrix
from solve.linear import factorise

E, POISSON = 2000.0, 0.38
SHEAR = 0.5 * E / (1.0 + POISSON)
SIDE, THICKNESS = 4.0, 2.5
ON_PLANE = 1e-9
CUT = 0.05  # of an area: 70 cells of 0.25 mm on the edges of a ring of 9 mm^2, a third of a cell each, two sigma


@pytest.fixture(scope="module")
def basis():
    """Return the displacements of a cube of 4 mm in 8 elements, its side face at y = 4 mm named."""
    cube = MeshHex2.from_mesh(MeshHex1.init_tensor(*3 * (np.linspace(0.0, SIDE, 3),)))
    cube = cube.with_boundaries({"side": lambda x: np.abs(x[1] - SIDE) < ON_PLANE})
    return vector_basis(cube, ElementHexS2(), order=3)


def layer(**changes):
    return ElasticLayer(**{"name": "side", "thickness": THICKNESS, **changes})


def test_stiff_block_on_a_layer_moves_as_far_as_a_sheared_and_a_stretched_strip(basis):
    """F t / (G A) along the layer and F t / (E A) across it: a block 1e6 times as stiff as the layer."""
    matrix = stiffness_matrix(basis, 1e6 * E, POISSON) + layer_matrix(basis, [layer()], E, POISSON)
    factor = factorise(matrix, np.zeros(0, dtype=np.int64))
    for axis, modulus in enumerate((SHEAR, E, SHEAR)):
        unit = np.zeros(basis.N)
        unit[np.concatenate([basis.nodal_dofs[axis], basis.edge_dofs[axis]])] = 1.0
        # The layer's own reaction to a shift of the whole block turns nothing.
        force = layer_matrix(basis, [layer()], E, POISSON) @ unit
        u = factor.solve(force / float(unit @ force))
        moved = float(unit @ u) / float(unit.sum())
        assert moved == pytest.approx(THICKNESS / (modulus * SIDE**2), rel=1e-4)


@pytest.mark.parametrize(
    ("place", "area"),
    [
        ({}, SIDE**2),
        ({"rectangles": (((0.0, 2.0), (0.0, 4.0)),)}, 8.0),
        ({"rectangles": (((0.0, 2.0), (0.0, 4.0)), ((1.0, 3.0), (0.0, 4.0)))}, 12.0),
        ({"discs": ((2.0, 2.0, 1.7),)}, math.pi * 1.7**2),
        ({"discs": ((2.0, 2.0, 1.9),), "holes": ((2.0, 2.0, 0.9),)}, math.pi * (1.9**2 - 0.9**2)),
        ({"rectangles": (((2.0, 4.0), (0.0, 4.0)),), "discs": ((2.0, 2.0, 1.7),)}, 0.5 * math.pi * 1.7**2),
    ],
)
def test_area_under_a_layer_is_that_of_its_rectangles_and_rings(basis, place, area):
    """The stiffness across a layer whose far side is held is E A / t."""
    across = np.zeros(basis.N)
    across[np.concatenate([basis.nodal_dofs[1], basis.edge_dofs[1]])] = 1.0
    stiffness = across @ layer_matrix(basis, [layer(**place)], E, POISSON) @ across
    assert stiffness * THICKNESS / E == pytest.approx(area, rel=CUT)
