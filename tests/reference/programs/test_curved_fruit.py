"""Curved bodies against direct finite elements in tetrahedra: under the rigid tips themselves, and on CAD solids."""

import dataclasses

import pytest

from reference.curved_fruit import bent_by_height, block_mesh, change_along_normals, sizes, solid_change
from reference.direct_fruit import mesh_compliance
from sensor.design.fruit import Fruit
from sensor.design.tips import Tips
from solve.fruit.curved_body import SAFETY, STEPS, shape_change
from solve.fruit.split import relative_changes, split_compliance, tip_footprints

TIPS = Tips()
PIECE = Fruit(shape="sphere", radius_mm=35.0, length_mm=20.0, width_mm=20.0, thickness_mm=12.0)
SMALL = dataclasses.replace(PIECE, radius_mm=15.0)
BALL = Fruit(shape="sphere", radius_mm=35.0, thickness_mm=65.0)
EGG = Fruit(shape="ellipsoid", radius_mm=35.0, radius_across_mm=25.0, thickness_mm=50.0)
ALLOWED = 1e-3  # of s11 - s12, besides the bar


def paired(S):
    return float(0.5 * (S[0, 0] + S[1, 1]) - S[0, 1])


def found(fruit, *, along_normals=False):
    """Return the change of s11 - s12 by the shape, its bar and s11 - s12 of the block [1/mm]."""
    change = shape_change(fruit, tip_footprints(TIPS), STEPS, along_normals)
    S = split_compliance(fruit.equivalent_block, TIPS).S
    errors = SAFETY * relative_changes(change.step, S) + relative_changes(change.bound, S)
    return paired(change.change), float(errors[0]) * paired(S), paired(S)


def rigid_change(fruit, scale):
    """Return the change of s11 - s12 [1/mm] under rigid tips, on one mesh of the block and the same mesh bent."""
    block = block_mesh(fruit, TIPS, sizes(TIPS, scale, 0.5 * scale**0.25, 2.0 * scale**0.25))
    bent = bent_by_height(block, fruit)
    return paired(mesh_compliance(bent, fruit.poisson).S) - paired(mesh_compliance(block, fruit.poisson).S)


def rigid_limit(fruit, coarse):
    """Return the limit of the change at size zero: its error is of first order in the size at the edge of the tips."""
    return 2.0 * rigid_change(fruit, 0.5 * coarse) - rigid_change(fruit, coarse)


@pytest.mark.slow
def test_piece_under_rigid_tips():
    change, bar, whole = found(SMALL)
    truth = rigid_limit(SMALL, 2.0)
    assert abs(change - truth) <= ALLOWED * whole + bar
    assert change > ALLOWED * whole + bar  # a body that is left out would be seen


@pytest.mark.study
@pytest.mark.parametrize("fruit", [PIECE, SMALL, dataclasses.replace(SMALL, poisson=0.0)])
def test_pieces_under_rigid_tips_on_finer_meshes(fruit):
    change, bar, whole = found(fruit)
    assert abs(change - rigid_limit(fruit, 0.5)) <= 0.1 * ALLOWED * whole + bar


@pytest.mark.slow
@pytest.mark.parametrize("fruit", [pytest.param(PIECE, marks=pytest.mark.study), SMALL])
def test_pieces_along_their_normals(fruit):
    """As domes press; along the vertical the shape changes another amount, which the bar tells apart."""
    vertical, _, _ = found(fruit)
    change, bar, whole = found(fruit, along_normals=True)
    truth = change_along_normals(fruit, TIPS, sizes(TIPS, 2.0, 0.4, 2.0))
    assert abs(change - truth) <= 0.3 * ALLOWED * whole + bar
    assert abs(change - vertical) > 0.3 * ALLOWED * whole + bar


@pytest.mark.study
@pytest.mark.parametrize("fruit", [PIECE, BALL, EGG])
def test_solids_of_the_cad_kernel(fruit):
    change, bar, whole = found(fruit)
    truth = solid_change(fruit, TIPS, sizes(TIPS, 1.0, 0.22, 6.0 if fruit.whole else 2.0))
    assert abs(change - truth) <= 0.3 * ALLOWED * whole + bar
