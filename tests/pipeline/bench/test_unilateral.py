"""Rigid tips on the curved, tilted fruit: one scene for the product and its peers, and CalculiX's deck of it."""

import shutil

import numpy as np
import pytest

from cad.parts.fruit import curved_half
from pipeline.bench import unilateral
from pipeline.bench.calculix import calculix_on
from pipeline.bench.punch_deck import punch_deck_text
from pipeline.bench.unilateral import FACES, SCENE, TIPS, TRAVEL_MM


@pytest.fixture(scope="module")
def deck():
    return unilateral.half_deck(unilateral.half_mesh(curved_half(unilateral.FRUIT, TIPS), 4.0))


def test_plane_of_the_tips_is_where_the_scene_has_it():
    """The high tip, at x > 0, is lower by the tangent of the tilt; level tips would just touch before their travel."""
    height, slope = unilateral.tip_plane()
    assert slope == pytest.approx(-np.tan(np.radians(1.0)), rel=1e-12)
    nearest = TIPS.centres_mm[1] - 0.5 * TIPS.side_mm
    touch = np.sqrt(35.0**2 - nearest**2) - 35.0
    assert height == pytest.approx(touch - TRAVEL_MM, abs=1e-6)
    for name, punch in unilateral.punches().items():
        assert np.ptp(punch.face[0]) == pytest.approx(TIPS.side_mm)
        assert punch.face[2] == pytest.approx(height + slope * punch.face[0])
        assert punch.face[0].mean() == pytest.approx(TIPS.centres_mm[FACES.index(name)])


def test_bar_of_the_product_counts_what_its_status_leaves_open():
    """Tips tilted by 1 degree, skin that falls by asin(4 / 35) under the low one: forces by the cosine of both."""
    (ours,) = unilateral.product_rows()
    slope = 4.0 / np.sqrt(35.0**2 - 4.0**2) + np.tan(np.radians(1.0))
    assert pytest.approx(np.hypot(1.0, slope) - 1.0, rel=1e-9) == unilateral.SMALL_SLOPE
    assert unilateral.SMALL_SLOPE < ours.error_bar < unilateral.SMALL_SLOPE + 0.005


def test_tips_stand_over_their_faces_on_the_sphere(deck):
    x, y, z = deck.elements.nodes
    for name, centre in zip(FACES, TIPS.centres_mm, strict=True):
        on = deck.sets[name]
        assert np.abs(x[on] - centre).max() == pytest.approx(0.5 * TIPS.side_mm, abs=1e-6)
        assert (y[on].min(), y[on].max()) == pytest.approx((0.0, 0.5 * TIPS.side_mm), abs=1e-6)
        skin = np.sqrt(35.0**2 - x[on] ** 2 - y[on] ** 2) - 35.0
        assert np.abs(z[on] - skin).max() < 0.4**2 / (8.0 * 35.0) + 1e-6  # the middle of a straight edge of 0.4 mm


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")
def test_calculix_presses_like_the_product(deck):
    """On a coarse mesh forces are too large, as prescribed displacements always make them, by less than a fifth.

    docs/benchmarks.md has 7.7 % on half the size at the edges: at first order 15 % here, and a third more is allowed.
    """
    (result,), cpu = calculix_on(punch_deck_text(deck, unilateral.punches(), TRAVEL_MM), deck)
    (ours,) = unilateral.product_rows()
    truth = np.array(unilateral.BENCH.reference.values)
    theirs = np.array([2.0 * abs(result.forces[name]) for name in FACES]) / truth - 1.0
    assert cpu > 0.0
    assert np.all((theirs > 0.0) & (theirs < 0.2))
    allowed = ours.error_bar + unilateral.BENCH.reference.relative_error
    assert np.all(np.abs(ours.errors) < allowed)
    assert SCENE.press.tilt_deg == 1.0
