"""The error bar that two meshes give: wider for leaves of an odd shape."""

import dataclasses

import pytest
from stand_ins import default_housing

from pipeline.springs.leaf_lengths import DEFAULT, MESH_PAIRS, mesh_pairs_for, odd_shape_factor

HOUSING = default_housing()


def shaped(**sizes):
    """Return the housing with leaves of other sizes [mm]."""
    flexures = {arm.name: dataclasses.replace(arm.flexure, **sizes) for arm in HOUSING.arms}
    return dataclasses.replace(HOUSING, tip_side=min(1.0, sizes["depth"])).with_flexures(flexures)


def test_leaf_as_thick_as_deep_has_two_and_a_half_times_the_share():
    thick = shaped(depth=0.4)
    assert [odd_shape_factor(arm.flexure) for arm in thick.arms] == [2.5, 2.5]
    assert DEFAULT.errors(thick, (0.01, 0.02)) == pytest.approx((2.5 * 0.01 + 1e-4, 2.5 * 0.02 + 1e-4))


def test_leaf_much_deeper_than_long_has_a_wider_share():
    """1 + 1.5 t / w + 2 (1 - L / 0.8 w) with t 0.8 and 1.2, w 50 and L 10 mm."""
    factors = [1.0 + 1.5 * t / 50.0 + 2.0 * (1.0 - 10.0 / 40.0) for t in (0.8, 1.2)]
    bars = DEFAULT.errors(shaped(depth=50.0, length=10.0), (0.01, 0.02))
    assert bars == pytest.approx((factors[0] * 0.01 + 1e-4, factors[1] * 0.02 + 1e-4))


def test_pairs_come_cheapest_first_and_a_tight_tolerance_leaves_the_coarse_ones_out():
    assert [pair.fine for pair in MESH_PAIRS] == sorted((pair.fine for pair in MESH_PAIRS), reverse=True)
    assert mesh_pairs_for(0.02) == MESH_PAIRS
    assert mesh_pairs_for(1e-4) == MESH_PAIRS[-1:]
