"""The bolted plates of a square without the symmetry that the product takes: a cover in front, the twin behind.

The product solves half a plate, with half of both layers on its side face. Here is the whole plate, swept over its full
depth, with each layer whole and on its own side.
"""

import dataclasses

import numpy as np
import pytest
from skfem import ElementHexS2, MeshHex2
from squares import RESIN, square_housing

from cad.parts.housing import Housing
from mesh.housing import sweep
from mesh.housing.blocks import counts
from mesh.housing.frame import housing_blocks
from mesh.housing.profile import meshed_profile
from pipeline.springs.mounts import mount_layers
from solve.elasticity import stiffness_matrix, vector_basis
from solve.housing.clamped_half import REDUCED, face_mean
from solve.housing.elastic_layer import ElasticLayer, layer_matrix
from solve.housing.stiffness import tip_compliance
from solve.linear import factorised

pytestmark = pytest.mark.slow

SCALE = 4.0  # of the mesh: what is compared is one mesh with itself
MATERIAL = (RESIN.E_MPa, RESIN.poisson)
SAME = 1e-7  # round-off of a solve
ONE_SIDED = 5e-4  # of a stiffness, that layers of two kinds on two sides may make: less than the bar of K_h


def whole_mesh(housing: Housing) -> MeshHex2:
    """Return the mesh of a whole plate [mm] with the boundaries low_tip, high_tip, front and back."""
    profile, half = meshed_profile(housing_blocks(housing, counts(housing, SCALE))), sweep._layers(2)
    straight = sweep._swept(profile, 0.5 * housing.depth * np.concatenate([-half[::-1], half[1:]]))
    places = sweep._curved(MeshHex2.from_mesh(straight), profile)
    places[1] *= sweep._depth_share(housing, places[0], places[2])
    outside = straight.boundary_facets()
    x, y, z = straight.p[:, straight.facets[:, outside]]
    level, deep = np.abs(z).max(axis=0) < 1e-7, y * sweep._depth_share(housing, x, z)
    named = {f"{arm.name}_tip": outside[level & (arm.sign * x.mean(axis=0) > 0.0)] for arm in housing.arms}
    for name, side in (("front", -0.5), ("back", 0.5)):
        named[name] = outside[(np.abs(deep - side * housing.depth) < 1e-7).all(axis=0)]
    return dataclasses.replace(MeshHex2.from_mesh(straight), doflocs=places).with_boundaries(named)


@pytest.fixture(scope="module")
def stiffness():
    """Return a function from layers to the stiffness of both springs of the whole plate [N/mm]."""
    housing = square_housing()
    basis = vector_basis(whole_mesh(housing), ElementHexS2(), order=REDUCED)
    matrix = stiffness_matrix(basis, *MATERIAL)
    mean = np.column_stack([face_mean(basis, f"{arm.name}_tip", 2) for arm in housing.arms])

    def solved(layers: list[ElasticLayer]) -> np.ndarray:
        held = matrix + layer_matrix(basis, layers, *MATERIAL)
        return 1.0 / np.diag(mean.T @ factorised(held, np.zeros(0, dtype=np.int64)).solve(mean))

    return solved


def placed(layer: ElasticLayer, name: str, share: float) -> ElasticLayer:
    """Return a layer on another surface, its thickness times a share [1]."""
    return dataclasses.replace(layer, name=name, thickness=share * layer.thickness)


def test_half_plate_is_the_whole_one_with_both_layers_on_both_sides(stiffness):
    housing = square_housing()
    both = [placed(layer, side, 1.0) for layer in mount_layers(housing) for side in ("front", "back")]
    half = tip_compliance(sweep.flexure_mesh(housing, SCALE), *MATERIAL, mount_layers(housing)).K
    assert stiffness(both) == pytest.approx(half, rel=SAME)


def test_cover_in_front_and_twin_behind_are_as_good_as_both_on_both_sides(stiffness):
    housing = square_housing()
    own, twin = mount_layers(housing)
    both = [placed(layer, side, 1.0) for layer in (own, twin) for side in ("front", "back")]
    as_bolted = stiffness([placed(own, "front", 0.5), placed(twin, "back", 0.5)])
    apart = as_bolted / stiffness(both) - 1.0
    print("one-sided", 100.0 * apart, "%")
    assert np.all(apart < 0.0)
    assert np.all(np.abs(apart) < ONE_SIDED)
    # Without the twin it is another sensor.
    assert stiffness([placed(own, "front", 0.5)])[1] < as_bolted[1] * (1.0 - ONE_SIDED)
