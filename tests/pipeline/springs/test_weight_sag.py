"""What the weight of the shuttles does to the tips, by attitude."""

from dataclasses import replace

import pytest
from squares import GENTLE
from stand_ins import PETG, default_housing, fitted_housing, housing_stiffness, springs_of

from mesh.housing.sweep import flexure_mesh
from pipeline.springs.fitted_springs import tip_height_offsets, weight_sag
from pipeline.springs.leaf_lengths import COARSE
from pipeline.springs.mounts import mount_layers
from sensor.design.parameters import Design
from sensor.design.tips import Tips
from solve.housing.stiffness import tip_compliance

G = 9.80665e-6  # N/mm^3 for 1 g/cm^3
SHAPE = 0.02  # of the sag: what rigid shuttles, fillets and the give of the frame leave out


@pytest.fixture(scope="module")
def springs():
    """Return the springs of the default design with the stiffness and the sag that a coarse mesh finds."""
    given = springs_of(Design())
    tips = tip_compliance(flexure_mesh(given.housing, COARSE), PETG.E_MPa, PETG.poisson, mount_layers(given.housing))
    solved = housing_stiffness(
        tips.K, weight_sag=tips.weight_sag, weight_sag_lengthwise=tips.weight_sag_lengthwise, C=tips.C
    )
    return replace(given, fitted=fitted_housing(given.housing, solved))


def hanging_volume(housing, arm):
    """Return block, tapered neck and tip of a shuttle with half of its two leaves [mm^3]."""
    section, face = housing.shuttle_width * housing.depth, housing.tip_side**2
    neck = (housing.neck_level - housing.tip_height) * (section + face + (section * face) ** 0.5) / 3.0
    block = section * (arm.top_level - housing.neck_level)
    leaf = arm.flexure.thickness * arm.flexure.length * arm.flexure.depth
    return block + neck + face * housing.tip_height + leaf


def test_sag_is_the_weight_that_hangs_over_the_stiffness(springs):
    """A sensor that presses up draws its tips in, and one held sideways leaves them."""
    sags = [weight_sag(springs, attitude) for attitude in ("down", "up", "side")]
    rows = zip(*sags, springs.housing.arms, springs.fitted.stiffness.K, strict=True)
    for down, up, side, arm, stiffness in rows:
        weight = G * PETG.density_g_per_cm3 * hanging_volume(springs.housing, arm)
        assert down.value == pytest.approx(weight / stiffness, rel=SHAPE)
        assert (up.value, side.value) == (-down.value, 0.0)
        for sag in (down, side):
            assert 0.0 < sag.error < 0.01 * down.value


def test_pin_adds_its_own_weight(springs):
    housing = default_housing(Design(tips=Tips(socket="pin")))
    pinned = replace(springs, fitted=fitted_housing(housing, springs.fitted.stiffness))
    steel = housing.pin.side**2 * (housing.pin.protruding_length + housing.pin.pocket_depth)
    plastic = housing.pin.side**2 * housing.pin.pocket_depth
    grams = 7.85 * steel - PETG.density_g_per_cm3 * plastic
    rows = zip(weight_sag(pinned, "down"), weight_sag(springs, "down"), pinned.fitted.stiffness.K, strict=True)
    for sag, bare, K in rows:
        assert sag.value - bare.value == pytest.approx(G * grams / K)


def test_springs_that_are_not_made_do_not_sag():
    assert weight_sag(springs_of(Design(), made=False), "down") == ()


def test_low_tips_of_a_square_lead_by_the_same_and_its_high_tips_lie_level_behind(springs):
    low, high = (sag.value for sag in weight_sag(springs, "down"))
    square = replace(springs, tips=GENTLE.tips)
    assert tip_height_offsets(square, "down") == pytest.approx((0.0, high - low, 0.0, high - low))
    assert tip_height_offsets(springs, "down") == pytest.approx((0.0, high - low))
    assert tip_height_offsets(square, "side") == ()
