"""The change by the shape of a fruit: limits, symmetry, its bar against finer meshes, and planted faults."""

import dataclasses

import numpy as np
import pytest
from bars import bars, holds

import solve.fruit.curved_body
import solve.fruit.smooth_load
from benchmarks.bars.curved_body import PAIR, change_on, pair_change, relative_bars
from sensor.design.fruit import Fruit
from sensor.design.tips import Tips
from sensor.quantity import InputError
from solve.fruit.bent_block import bent_block
from solve.fruit.body_lines import BodySteps
from solve.fruit.curved_body import (
    LOG_OFFSET,
    ROUGH_STEPS,
    STEPS,
    check_curved,
    curvature_correction,
    curved_compliance,
    shape_change,
)
from solve.fruit.curved_shape import CurvedShape
from solve.fruit.footprints import Footprint
from solve.fruit.smooth_load import line_fractions, smooth_loads
from solve.fruit.split import (
    LEVELS,
    contact_footprints,
    footprint_compliance,
    relative_changes,
    split_compliance,
)
from solve.linear import SolveError

PIECE = Fruit(shape="sphere", radius_mm=35.0, length_mm=20.0, width_mm=20.0, thickness_mm=12.0)
SMALL = dataclasses.replace(PIECE, radius_mm=15.0)
BALL = Fruit(shape="sphere", radius_mm=35.0, thickness_mm=65.0)
EGG = Fruit(shape="ellipsoid", radius_mm=35.0, radius_across_mm=25.0, thickness_mm=50.0)
MANGO = Fruit(
    shape="ellipsoid", radius_mm=42.5, radius_across_mm=96.0, thickness_mm=11.0, length_mm=24.0, width_mm=24.0
)
THIN = dataclasses.replace(MANGO, thickness_mm=8.0)
FINER = BodySteps(growth=0.5, largest=0.2, most_dofs=20_000)


def missed(found, truth, S):
    return relative_changes(found.change - truth, S)


@pytest.mark.parametrize("name", bars("curved body"))
def test_error_bar_holds(name):
    """Under rigid tips two sizes at their edges are extrapolated; along the normals loads are round along the skin."""
    holds(name)


def domes_on(fruit):
    return contact_footprints(
        fruit, Tips(layout="square", shape="dome", dome_radius_mm=9.8, side_mm=5.8, spacing_mm=6.3)
    )


@pytest.mark.parametrize(
    ("fruit", "footprints", "along_normals", "coarse", "fine"),
    [
        pytest.param(SMALL, PAIR, False, STEPS, FINER, id="finer", marks=pytest.mark.slow),
        pytest.param(SMALL, PAIR, False, ROUGH_STEPS, STEPS, id="rigid tips", marks=pytest.mark.slow),
        pytest.param(EGG, PAIR, False, ROUGH_STEPS, STEPS, id="egg", marks=pytest.mark.slow),
        pytest.param(MANGO, domes_on(MANGO), True, ROUGH_STEPS, STEPS, id="domes", marks=pytest.mark.slow),
        pytest.param(THIN, domes_on(THIN), True, ROUGH_STEPS, STEPS, id="thin flesh", marks=pytest.mark.slow),
    ],
)
def test_finer_mesh_lies_inside_the_bar(fruit, footprints, along_normals, coarse, fine):
    found, truth = (change_on(fruit, tuple(footprints), steps, along_normals) for steps in (coarse, fine))
    S = footprint_compliance(fruit.equivalent_block, footprints, LEVELS[0]).S
    assert found.dofs < (0.5 if coarse is ROUGH_STEPS else 1.0) * truth.dofs
    assert (missed(found, truth.change, S) <= relative_bars(found, S)).all()
    assert coarse is ROUGH_STEPS or relative_bars(found, S).max() <= 1e-3


@pytest.mark.slow
def test_rough_meshes_are_taken_where_they_meet_the_tolerance():
    block = split_compliance(SMALL.equivalent_block, Tips())
    rough = curved_compliance(block, SMALL, PAIR, tolerance=0.1)
    bar = max(rough.difference_error - block.difference_error, rough.s11_error - block.s11_error)
    met, missed_by_little = (curved_compliance(block, SMALL, PAIR, tolerance=bar * by) for by in (1.001, 0.999))
    np.testing.assert_array_equal(met.S, rough.S)
    np.testing.assert_array_equal(missed_by_little.S, curved_compliance(block, SMALL, PAIR).S)
    assert missed_by_little.difference_error < rough.difference_error


def test_compliance_carries_the_change_and_says_how_much(monkeypatch):
    monkeypatch.setattr(solve.fruit.curved_body, "shape_change", lambda fruit, *_: pair_change(fruit))
    block = split_compliance(SMALL.equivalent_block, Tips())
    found = curved_compliance(block, SMALL, PAIR)
    np.testing.assert_allclose(found.S - found.shape_change, block.S, rtol=1e-12)
    assert block.difference_error < found.difference_error <= 1e-3


@pytest.mark.parametrize(
    ("fruit", "tips", "field"),
    [
        (dataclasses.replace(BALL, thickness_mm=68.0), Tips(), "fruit.thickness_mm"),
        (SMALL, Tips(side_mm=4.0, spacing_mm=8.0), "fruit.radius_mm"),
        (SMALL, Tips(spacing_mm=16.0), "centre of a tip, x"),
        (Fruit(shape="sphere", radius_mm=35.0, thickness_mm=1.3), Tips(), "reach of the tips along x"),
    ],
)
def test_what_is_not_solved_is_refused(fruit, tips, field):
    block = split_compliance(PIECE.equivalent_block, Tips())
    with pytest.raises(InputError) as refused:
        curved_compliance(block, fruit, contact_footprints(fruit, tips))
    assert refused.value.field == field


def test_shares_of_a_line_are_the_moments_of_the_load():
    """Quadratic functions are carried exactly: weight 1, centre and variance of the normal distribution."""
    nodes, shares = line_fractions(np.array([-10.0, -3.0, 2.0, 3.5, 10.0]), 2.0, 0.6, 0)
    assert shares.sum() == pytest.approx(1.0, rel=1e-9)
    assert shares @ nodes == pytest.approx(2.0, rel=1e-9)
    assert shares @ (nodes - 2.0) ** 2 == pytest.approx(0.36, rel=1e-9)


def test_nodal_forces_on_a_turned_fruit_are_one_force_at_each_load():
    """A turned fruit has no mirror planes, so no load has an image: forces and moments are those of unit loads."""
    turned = dataclasses.replace(MANGO, azimuth_deg=30.0)
    loads = smooth_loads(turned, PAIR)
    block = bent_block(turned, PAIR, loads, BodySteps(most_dofs=2000), along_normals=False)
    (parity,) = block.parities
    forces = block.forces(parity, block.normals)[block.flat.get_dofs("top").all("u^3")]
    x, y = block.flat.doflocs[:2, block.flat.get_dofs("top").all("u^3")]
    assert forces.sum(axis=0) == pytest.approx(np.ones(len(loads)), rel=1e-9)
    assert x @ forces == pytest.approx([load.x for load in loads], abs=1e-9)
    assert y @ forces == pytest.approx([load.y for load in loads], abs=1e-9)


def test_a_fold_is_refused(monkeypatch):
    def inside_out(_self, points):
        return points * np.array([[1.0], [1.0], [1.0]]) - np.array([[0.0], [0.0], [2.0]]) * points[2] * (
            points[0] > 5.0
        )

    monkeypatch.setattr(solve.fruit.curved_body.CurvedShape, "bend", inside_out)
    with pytest.raises(SolveError):
        curvature_correction(PIECE, PAIR, smooth_loads(PIECE, PAIR), BodySteps())


@pytest.mark.slow
def test_a_turned_fruit_is_the_fruit_under_turned_tips():
    """Inside both bars; a fruit that is turned the other way is not."""
    fruit = Fruit(
        shape="ellipsoid", radius_mm=30.0, radius_across_mm=150.0, length_mm=30.0, width_mm=30.0, thickness_mm=12.0
    )
    turned = dataclasses.replace(fruit, azimuth_deg=45.0)
    square = Tips(layout="square", shape="dome", dome_radius_mm=10.0, side_mm=5.6)
    tips = contact_footprints(turned, square)
    on_axes = []
    for tip in tips:
        u, v = turned.to_principal(tip.x, tip.y)
        on_axes.append(dataclasses.replace(tip, x=round(u, 9), y=round(v, 9)))
    S = split_compliance(turned, square).S
    expected = shape_change(fruit, on_axes, along_normals=True)
    found = shape_change(turned, tips, along_normals=True)
    bar = relative_bars(found, S) + relative_bars(expected, S)
    assert (missed(found, expected.change, S) <= bar).all()
    other_way = shape_change(dataclasses.replace(fruit, azimuth_deg=-45.0), tips, along_normals=True)
    assert (missed(other_way, expected.change, S) > bar).any()


def test_skin_of_a_piece_is_as_thick_along_the_normal_everywhere():
    """On a ball the normal leans by asin(r / R); the base of the piece stays where it is."""
    fruit = dataclasses.replace(SMALL, skin_mm=0.4, skin_E_MPa=10.0)
    shape = CurvedShape(fruit, (0.5, 0.5))
    x, y = np.array([[0.0, 2.0, -3.0, 4.0], [0.0, 1.0, 5.0, -4.0]])
    top, under, base = (shape.bend(np.stack([x, y, np.full(4, z)])) for z in (0.0, 0.4, fruit.depth_mm))
    cosine = np.sqrt(1.0 - (x**2 + y**2) / fruit.radius_mm**2)
    assert (under - top)[2] * cosine == pytest.approx(0.4 * np.ones(4), rel=1e-12)
    assert base[2] == pytest.approx(fruit.depth_mm * np.ones(4), rel=1e-12)


@pytest.mark.parametrize(("x", "y", "axis"), [(4.0, 0.0, None), (14.0, 0.0, "x"), (0.0, 14.0, "y")])
def test_reach_on_a_whole_fruit(x, y, axis):
    """Tips near the apex are solved; those that reach over most of the cap, whose sides would fold, are refused."""
    cap = Fruit(shape="sphere", radius_mm=35.0, thickness_mm=12.0)
    pair = (Footprint(x, y, 1.0), Footprint(-x, -y, 1.0))
    if axis is None:
        check_curved(cap, pair)
        return
    with pytest.raises(InputError) as refused:
        check_curved(cap, pair)
    assert refused.value.field == f"reach of the tips along {axis}"


def test_mean_logarithm_of_a_circle():
    """Of the distance of two points it is ln a + 2 ln 2 - 3/2 in a rigid circle, ln (2 s) - gamma/2 in a normal load.

    The deviation s is a / sqrt(pi), by the mean of 1 / r. A square has 0.01 more: the offset lies between both.
    """
    circle = 2.0 * np.log(2.0) - 1.5
    normal = np.log(2.0) - 0.5 * np.log(np.pi) - 0.5 * np.euler_gamma
    assert 0.0 <= LOG_OFFSET - (circle - normal) <= 0.01
