"""The make-up of error bars: each size by its formula or another method, and nothing left out unsaid."""

import dataclasses
import math
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import stand_ins
from scenes import SPHERE
from scipy.optimize import brentq
from stand_ins import CONTACT, ERRORS, K_M_OVER_E, LENGTHS, sizing_of, springs_of

from pipeline.errors.budget import (
    budget_of,
    level_press,
    relative_change,
    total_errors,
    uncertainty_budgets,
)
from pipeline.errors.causes import LARGEST_MOUNT_CHANGES, after_calibration, all_causes
from pipeline.errors.targets import SceneTargets, force_ratio_curve
from pipeline.response.scene_press import curve_moduli, scene_of
from pipeline.springs.fitted_springs import GRAVITY
from sensor.design.fruit import Fruit
from sensor.design.parameters import Design, Print, Targets
from sensor.design.reading import ReadingRequirements
from sensor.design.tips import PressMotion, Tips
from sensor.quantity import Estimate
from sensor.theory.rounded_edge import edge_loss
from sensor.theory.sloped_skin import frictionless_stiffness_change
from sensor.theory.soft_tissue import constitutive_spread, large_strain_factor, no_slip_stiffness_change
from sensor.theory.two_spring_law import force_ratio, nonlinearity, series_ratio
from solve.contact.linear_response import travels
from solve.contact.scene import LateralCompliance
from solve.fruit.compliance import SkinTable
from solve.fruit.split import split_compliance

K_M = 3.5 * K_M_OVER_E
SPRINGS = sizing_of(Design()).springs
K_L, K_H = SPRINGS.stiffnesses
OF_SPRINGS = ["large deflection", "engraved marks", "elephant's foot", "mount", "creep"]
OF_FRUIT = ["no slip", "large strain", "law of the flesh"]
OF_PRINT = ["modulus", "leaf thickness"]
OF_TIPS = ["tip side", "tip edge"]
OF_SCENE = ["Poisson's ratio", "pose"]
FREE = Fruit(shape="sphere", radius_mm=35.0, thickness_mm=65.0)
PLAIN = Design()
LARGEST = Design(targets=Targets(NL_definition="largest"))
STEP = 4.0 * math.tan(math.radians(1.0))  # [mm] that one degree of tilt lifts or lowers a tip


def pair_of(design, springs=None):
    return stand_ins.draw_sensor(design, springs).pair


def budgets_of(design, springs=None):
    """Return the budgets as of a level pair, whatever the scene."""
    pair = pair_of(design, springs)
    law = force_ratio_curve(pair)
    return in_scene(pair, SceneTargets(P_max=law.P_max(), NL=law.NL(design.targets), level=None))


def in_scene(pair, reached, tilted=()):
    """Return the budgets of a pair in a scene with the responses of its tilted presses."""
    level = level_press(pair, curve_moduli(scene_of(pair.design)), travels(pair.design.press.travel_mm, 2))
    return uncertainty_budgets(pair, reached, SimpleNamespace(tilted=tilted), level)


def ratio_budget(pair, E, travel, numerical=0.0, of=tuple):
    """Return the budget of P in one press, by a selection of its causes."""
    press = level_press(pair, np.array([E]), np.array([travel]))
    return budget_of(numerical, of(press.causes), relative_change(press.largest_ratio))


def leaning(give):
    """Return the pair on a sphere whose springs give sideways by some compliance [mm/N]."""
    design = Design(fruit=SPHERE)
    return design, dataclasses.replace(springs_of(design), plate_sideways=LateralCompliance(give, 0.0))


@pytest.fixture(scope="module")
def budgets():
    return budgets_of(Design())


def size_of(budget, effect):
    (size,) = (part.size for part in (*budget.model, *budget.inputs) if part.effect == effect)
    return size


def names_of(contributions):
    return [contribution.effect for contribution in contributions]


@pytest.mark.parametrize(
    ("name", "model", "inputs"),
    [
        ("K_l", OF_SPRINGS, OF_PRINT),
        ("K_h", OF_SPRINGS, OF_PRINT),
        ("P_max", OF_SPRINGS + OF_FRUIT, [*OF_PRINT, *OF_TIPS, "tip height", *OF_SCENE]),
        ("NL", OF_SPRINGS + OF_FRUIT, [*OF_PRINT, *OF_TIPS, "tip height", *OF_SCENE]),
        ("contact", OF_FRUIT, [*OF_TIPS, "Poisson's ratio"]),
    ],
)
def test_every_number_says_all_three_shares(name, model, inputs, budgets):
    budget = getattr(budgets, name)
    assert (names_of(budget.model), names_of(budget.inputs)) == (model, inputs)
    assert budget.model_total == pytest.approx(sum(abs(each.size) for each in budget.model), rel=1e-12)
    assert budget.inputs_total == pytest.approx(math.sqrt(sum(each.size**2 for each in budget.inputs)), rel=1e-12)


def test_numerical_error_is_the_bar_that_the_verdicts_use(budgets):
    own = force_ratio_curve(pair_of(Design()))
    assert (budgets.K_l.numerical, budgets.K_h.numerical) == pytest.approx(ERRORS, rel=1e-12)
    for budget, number in ((budgets.P_max, own.P_max()), (budgets.NL, own.NL(Targets()))):
        assert budget.numerical == pytest.approx(number.relative, rel=1e-12)
    assert budgets.contact.numerical == CONTACT.difference_error


def elastica(K, L):
    """Return 36/35 (d / L)^2 at d = x K_m / (K_m + K)."""
    return 36.0 / 35.0 * (0.6 * K_M / (K_M + K) / L) ** 2


def equilibrium(stiffening):
    """Return P of springs F = K (1 + c (d / L)^2) d on fruit of the largest modulus pressed by 0.6 mm."""
    forces = []
    for K, L in zip(SPRINGS.stiffnesses, LENGTHS, strict=True):
        d = brentq(
            lambda d, K=K, L=L: K * (1.0 + stiffening * (d / L) ** 2) * d - K_M * (0.6 - d), 0.0, 0.6, xtol=1e-15
        )
        forces.append(0.6 - d)
    return forces[1] / forces[0]


def marks(K, share, known):
    """Return what marks take: the frame's share of 1/K, as K / (E w) goes, by 0.3 of the 9.7 mm that are left."""
    return -share * (K / known) * 6.0 / 10.0 * 0.3 / 9.7


def edge_of_P():
    """Return half of what rounder and sharper edges make of P, at the depth of each tip."""
    losses = [edge_loss(0.6 * K / (K + K_M), 1.0, 0.05) for K in SPRINGS.stiffnesses]
    rounder = series_ratio(K_L, K_H, *(K_M * (1.0 - loss) for loss in losses))
    sharper = series_ratio(K_L, K_H, *(K_M * (1.0 + loss) for loss in losses))
    return 0.5 * abs(sharper - rounder) / 5.0


def by_springs(number, low, high, springs=SPRINGS):
    """Return by how much a number of the two-spring law changes with both springs, which change by fractions [1]."""
    return number(springs.scaled((1.0 + low, 1.0 + high)), K_M) / number(springs, K_M) - 1.0


def by_modulus(number, springs=SPRINGS):
    """Return half of the change between prints of 1.2 and 0.8 times the modulus: two sigma of 10 %."""
    return 0.5 * abs(by_springs(number, 0.2, 0.2, springs) - by_springs(number, -0.2, -0.2, springs))


def largest_NL(springs, K_m):
    return nonlinearity(springs, K_m, "largest")


GRIPPED = (1.0 + no_slip_stiffness_change(0.3)) * K_M  # grip makes the fruit stiffer everywhere by the same share


def posed(travel):
    """Return by how much P changes where 1 deg of tilt takes one tip ahead of the other: two springs on one fruit."""
    A = np.diag([1.0 / K for K in SPRINGS.stiffnesses]) + CONTACT.S / 3.5
    low, high = np.linalg.solve(A, [travel - STEP, travel + STEP])
    level_low, level_high = np.linalg.solve(A, [travel, travel])
    return high / low / (level_high / level_low) - 1.0


def creeping(press_s, per_decade):
    """Return the stiffness of a press over that of a weight of 30 s, less 1, for a compliance straight over log t.

    The mean of the compliance over an even rise is that at 1/e of its end, of a hand that slows at e^-1/2.
    """
    return per_decade * math.log10(30.0 / (math.exp(-0.5) * press_s))


@pytest.mark.parametrize(
    ("design", "number", "effect", "size", "rel"),
    [
        (PLAIN, "K_l", "large deflection", elastica(K_L, LENGTHS[0]), 2e-3),
        # 1 %: stiffer springs bend less
        (PLAIN, "P_max", "large deflection", equilibrium(36.0 / 35.0) / equilibrium(0.0) - 1.0, 0.01),

        (PLAIN, "P_max", "no slip", force_ratio(SPRINGS, GRIPPED) / 5.0 - 1.0, 1e-6),
        (PLAIN, "NL", "no slip", nonlinearity(SPRINGS, GRIPPED) / 0.05 - 1.0, 1e-6),
        (PLAIN, "contact", "no slip", K_M / GRIPPED - 1.0, 1e-12),
        (PLAIN, "K_l", "engraved marks", marks(K_L, 8e-4, 0.753), 1e-9),
        (PLAIN, "K_h", "engraved marks", marks(K_H, 6e-3, 17.3), 1e-9),
        # 0.2 mm of the depth are 2 x 0.15 mm thicker, and K goes with the cube of t
        (PLAIN, "K_l", "elephant's foot", 0.2 / 10.0 * ((1.1 / 0.8) ** 3 - 1.0), 1e-9),
        (PLAIN, "K_h", "elephant's foot", 0.2 / 10.0 * ((1.5 / 1.2) ** 3 - 1.0), 1e-9),

        # the level law has no crosstalk, 1.4 % of S
        (PLAIN, "P_max", "mount", by_springs(force_ratio, *LARGEST_MOUNT_CHANGES), 0.02),
        (PLAIN, "P_max", "modulus", by_modulus(force_ratio), 1e-9),
        # the curve begins at 1e-9 of E_max, over an NL of 0.05
        (PLAIN, "NL", "modulus", by_modulus(nonlinearity), 1e-9 / 0.05),
        (PLAIN, "P_max", "tip edge", edge_of_P(), 1e-6),
        # 0.05 mm of 0.6: the level law with travels of 0.575 and 0.625 mm, but for 1.4 % of crosstalk
        (PLAIN, "P_max", "tip height", 0.625 / 0.575 - 1.0, 0.02),
        # ground pins: 0.01 mm off on a side of 1 mm; the edge costs what Sneddon's round tip loses at full travel
        (Design(tips=Tips(socket="pin")), "contact", "tip edge", edge_loss(0.6, 1.0, 0.01), 1e-3),
        (Design(tips=Tips(socket="pin")), "contact", "tip side", 0.01, 1e-3),
        (PLAIN, "P_max", "pose", posed(0.6), 1e-9),
        (Design(press=PressMotion(travel_mm=0.3)), "P_max", "pose", posed(0.3), 1e-9),
        # a tip that is taken off the fruit counts as the whole ratio
        (Design(press=PressMotion(travel_mm=0.05)), "P_max", "pose", 1.0, 0.0),
        (
            Design(fruit=SPHERE), "contact", "slope",
            1.0 / (1.0 + frictionless_stiffness_change(0.3, math.tan(math.asin(4.0 / 35.0)))) - 1.0, 1e-9,
        ),
        (PLAIN, "K_l", "creep", creeping(3.0, 0.025), 0.02),  # by hand
        (
            Design(fruit=Fruit(relaxation=((0.3, 2.0),)), press=PressMotion(speed_mm_per_s=0.06, hold_s=1.0)),
            "K_h", "creep", creeping(10.0, 0.025), 0.02,
        ),
        (Design(print=Print(process="sls-pa12")), "K_h", "creep", creeping(3.0, 0.06), 0.05),
        # the top of a parabola through 72 steps differs by more
        (LARGEST, "NL", "modulus", by_modulus(largest_NL, sizing_of(LARGEST).springs), 1e-4),
    ],
)  # fmt: skip
def test_size_of_an_effect_is_that_of_its_formula_or_of_another_method(design, number, effect, size, rel, budgets):
    found = budgets if design is PLAIN else budgets_of(design)
    assert size_of(getattr(found, number), effect) == pytest.approx(size, rel=rel)


def test_flat_tips_that_slide_give_sideways():
    """P of springs that are softer by what a force along the normal moves them down the slope."""
    slope = math.tan(math.asin(4.0 / 35.0))
    give = np.zeros((2, 2, 3, 3))
    more = []
    for tip, (K, sign) in enumerate(zip(SPRINGS.stiffnesses, (-1.0, 1.0), strict=True)):
        give[tip, tip, 0, 0] = 0.3 / K
        give[tip, tip, 0, 2] = give[tip, tip, 2, 0] = 0.05 / K
        # across the tips the fruit does not fall: what a spring gives there moves nothing
        give[tip, tip, 1] = give[tip, tip, :, 1] = 0.2 / K
        more.append((0.3 * slope**2 + 2.0 * 0.05 * sign * slope) / K)
    C = np.diag([1.0 / K for K in SPRINGS.stiffnesses])
    before, after = (np.linalg.solve(softened + CONTACT.S / 3.5, [0.6, 0.6]) for softened in (C, C + np.diag(more)))
    design, springs = leaning(give)
    size = size_of(budgets_of(design, springs).P_max, "sideways give")
    assert size == pytest.approx((after[1] / after[0]) / (before[1] / before[0]) - 1.0, rel=1e-9)
    dome = dataclasses.replace(design, tips=Tips(shape="dome", dome_radius_mm=2.0))
    for other in (budgets_of(design), budgets_of(dome, dataclasses.replace(springs, tips=dome.tips))):
        assert "sideways give" not in names_of(other.P_max.model)


@pytest.mark.parametrize(
    ("design", "number", "effect"),
    [
        (Design(print=Print(process="sls-pa12")), "K_l", "elephant's foot"),
        (Design(print=Print(process="dmls-17-4ph")), "K_l", "creep"),
        (Design(print=Print(process="dmls-17-4ph")), "P_max", "creep"),
        (Design(reading=ReadingRequirements()), "K_l", "creep"),  # the reading corrects it
        (Design(fruit=SPHERE), "P_max", "free fruit"),
        (Design(press=PressMotion(attitude="down")), "P_max", "weight"),  # it is part of the scene
    ],
)
def test_effect_that_does_not_act_is_not_listed(design, number, effect):
    budget = getattr(budgets_of(design), number)
    assert effect not in names_of((*budget.model, *budget.inputs))


def moved_NL(law):
    """Return NL where a law of flesh multiplies its stiffness under each tip by what it says of the depth [1].

    Independent: the forces of both tips are found by a fixed point, with the depths that they leave.
    """
    P = []
    for E in (1e-6, 1.75, 3.5):
        F = np.zeros(2)
        for _ in range(60):
            give = F / SPRINGS.stiffnesses
            stiffer = 1.0 + law((0.6 - give)[:, None])[:, 0]
            S = CONTACT.S / E
            own = (np.diag(S) - CONTACT.crosstalk / E) / stiffer
            A = np.diag(1.0 / np.array(SPRINGS.stiffnesses) + own) + CONTACT.crosstalk / E
            F = np.linalg.solve(A, [0.6, 0.6])
        P.append(F[1] / F[0])
    return (P[1] - P[0]) / (P[2] - P[0]) - 0.5


@pytest.mark.parametrize(
    ("effect", "law"),
    [
        ("large strain", lambda depths: large_strain_factor(depths, 0.3) - 1.0),
        ("law of the flesh", lambda depths: constitutive_spread(depths, 0.3)),
    ],
)
def test_laws_of_flesh_move_NL_by_their_size_on_each_fruit(effect, law, budgets):
    """Effects take the depths of the model, which the law itself changes."""
    moved = moved_NL(law) / moved_NL(np.zeros_like) - 1.0
    # A law of 0.1 changes the depth of the high tip by a fifth of that, as its spring takes a fifth of the travel.
    assert size_of(budgets.NL, effect) == pytest.approx(moved, rel=0.02)


def test_springs_that_are_not_made_have_no_error_of_their_own():
    budgets = budgets_of(Design(), springs_of(Design(), made=False))
    assert (budgets.K_l, budgets.K_h) == (None, None)
    assert names_of(budgets.P_max.model) == OF_FRUIT


@pytest.mark.parametrize(("poisson", "percent"), [(0.45, 9.0), (0.49, 12.0)])
def test_poissons_ratio_moves_P_as_another_fruit_does(poisson, percent):
    """Independent: the compliance of the block at that ratio, and the law."""
    other = split_compliance(Fruit(poisson=poisson), Tips(), 0.001).K_m_over_E()
    true = force_ratio(SPRINGS, 3.5 * other) / 5.0 - 1.0
    down = budgets_of(Design(fruit=Fruit(poisson_spread=poisson - 0.3))).P_max
    assert round(100.0 * true) == percent
    # the spread goes both ways, and the fruit gains more above 0.3 than it loses below: half of the whole range
    assert size_of(down, "Poisson's ratio") == pytest.approx(true, rel=0.1)


def test_weight_of_a_sensor_that_is_held_sideways_says_what_pressing_down_does():
    """0.019 mm of the low tip at 0.6 mm of travel."""
    springs = springs_of(Design())
    weight = GRAVITY * springs.process.density_g_per_cm3
    sagging = dataclasses.replace(springs.fitted.stiffness, weight_sag=(0.02 / weight, 0.001 / weight))
    heavy = dataclasses.replace(springs, fitted=dataclasses.replace(springs.fitted, stiffness=sagging))
    assert size_of(budgets_of(Design(), heavy).P_max, "weight") == pytest.approx(
        0.019 / 0.6, rel=0.02
    )  # 1.4 % of crosstalk


def free_fruit(fruit, travel=0.6):
    (cause,) = (
        one for one in all_causes(pair_of(Design(fruit=fruit)), travel, np.zeros(2)) if one.name == "free fruit"
    )
    return cause


def test_turn_of_a_ball_that_lies_free():
    """Rolling by u meets the moment sum k x with sum k - sum k x^2 / (R travel) a millimetre; the tips turn with it."""
    travel, radius = 0.6, 200.0
    free = free_fruit(Fruit(shape="sphere", radius_mm=radius, thickness_mm=395.0))
    low, high = (1.0 / (1.0 / K + 1.0 / K_M) for K in SPRINGS.stiffnesses)
    turn = (high - low) * 4.0 / (low + high - (low + high) * 16.0 / (radius * travel)) / radius
    assert free.height_offsets == pytest.approx((-4.0 * turn, 4.0 * turn), rel=1e-9)
    # a ball of 35 mm runs away: one tip loses the whole travel more than the other, which is twice what there is
    assert free_fruit(FREE).height_offsets == pytest.approx((-travel, travel), rel=1e-9)
    friction = 4.0 * (5.0 - 1.0) / (2.0 * 35.0 * (5.0 + 1.0))  # moment over 2 R times all force
    (rolled,) = (one for one in budgets_of(Design(fruit=FREE)).P_max.model if one.effect == "free fruit")
    assert abs(rolled.size) > 0.3
    assert f"(friction of {friction:.2g} holds it)" in rolled.reason


def under_a_skin():
    """Return the sensor on flesh whose compliance times E falls as the flesh gets stiffer."""
    pair = pair_of(Design())
    E = np.array([0.1, 1.0, 4.0])
    table = SkinTable(E=E, S=np.multiply.outer(1.0 - 0.1 * np.log(E), CONTACT.S))
    return dataclasses.replace(pair, contact=dataclasses.replace(pair.contact, skin=table))


@pytest.mark.parametrize(
    "made",
    [
        lambda: pair_of(Design()),
        lambda: pair_of(Design(fruit=FREE)),
        under_a_skin,
        lambda: pair_of(*leaning(np.einsum("ij,kl->ijkl", np.diag([0.3 / K_L, 0.3 / K_H]), np.diag([1.0, 0.0, 0.0])))),
    ],
    ids=["block", "free fruit", "skin", "sideways"],
)
def test_errors_of_a_table_are_those_of_each_press_by_itself(made):
    """Also where a tip is taken off the fruit, at a travel of 0.05 mm."""
    pair = made()
    E, travel = np.array([0.35, 1.75, 3.5]), np.array([0.05, 0.3, 0.6])
    numerical = np.arange(9.0).reshape(3, 3) * 1e-4
    press = level_press(pair, E, travel)
    found = total_errors(numerical, press.causes, relative_change(press.ratio))
    for i, j in np.ndindex(3, 3):
        by_itself = ratio_budget(pair, float(E[i]), float(travel[j]), float(numerical[i, j]))
        assert found[i, j] == pytest.approx(by_itself.total, rel=1e-12)


def test_deflections_off_the_middle():
    """Off the middle the fruit is stiffer under the high tip by the stiffness ratio: deflections of both in series."""
    law = dataclasses.replace(force_ratio_curve(pair_of(Design())), stiffness_ratio=1.25)
    deflections = law.deflections(2.0, 0.6)
    assert deflections == pytest.approx((0.6 * 2.0 / (2.0 + K_L), 0.6 * 2.5 / (2.5 + K_H)), rel=1e-12)


def test_numbers_of_a_solved_scene():
    """The pose is the worst of the tilted presses: P of 4.5 and 5.8, and curves bent by 0.06 and 0.03 of their rise.

    Other causes move NL as they move the 0.05 of a level sensor, over the NL of the scene.
    """
    pair = pair_of(Design())
    reached = SceneTargets(P_max=Estimate(5.0, 0.01), NL=Estimate(0.04, 0.001), level=None)
    tilted = [SimpleNamespace(P=np.array([[1.0], [middle], [top]])) for middle, top in ((2.96, 4.5), (3.544, 5.8))]
    budgets = in_scene(pair, reached, tilted)
    assert size_of(budgets.P_max, "pose") == pytest.approx(5.8 / 5.0 - 1.0, rel=1e-9)
    assert size_of(budgets.NL, "pose") == pytest.approx(0.06 / 0.04 - 1.0, rel=1e-9)
    assert size_of(budgets.NL, "modulus") == pytest.approx(by_modulus(nonlinearity) * 0.05 / 0.04, rel=1e-6)
    off = [SimpleNamespace(P=np.array([[1.0], [2.9], [top]])) for top in (math.nan, 5.0)]
    budgets = in_scene(pair, reached, off)
    assert size_of(budgets.P_max, "pose") == 1.0


def test_bound_of_mounts_is_the_largest_change_of_its_page_with_a_margin_of_a_quarter():
    """Rounded up to 1e-4; the two digits of the page hide up to 5e-5 of a change."""
    page = (Path(__file__).parents[3] / "docs" / "measurements.md").read_text(encoding="utf-8")
    largest = re.search(r"^- largest by any other mount: K_l (\S+) %, K_h (\S+) %$", page, re.MULTILINE)
    margin = np.abs(LARGEST_MOUNT_CHANGES) - 1.25 * 0.01 * np.array(largest.groups(), dtype=float)
    assert margin.min() >= 0.0
    assert margin.max() <= 1e-4 + 1.25 * 5e-5


def test_largest_spring_error(budgets):
    """The larger error is used, and no error of a spring that is not made."""
    largest = max(budgets.K_l.inputs_total, budgets.K_h.inputs_total)
    assert (budgets.largest_spring_error, budgets.K_l.inputs_total < budgets.K_h.inputs_total) == (largest, False)
    assert budgets_of(Design(), springs_of(Design(), made=False)).largest_spring_error == 0.0


def test_calibrating_leaves_one_per_cent_a_spring_and_takes_the_print_away():
    pair = pair_of(Design())
    printed = ratio_budget(pair, 3.5, 0.6, 1e-4)
    calibrated = ratio_budget(pair, 3.5, 0.6, 1e-4, after_calibration)
    left = names_of((*calibrated.model, *calibrated.inputs))
    assert not {*OF_PRINT, "engraved marks", "elephant's foot", "mount"} & set(left)
    assert size_of(calibrated, "tip height") == pytest.approx(0.605 / 0.595 - 1.0, rel=0.02)  # zeroed to 0.01 mm
    for effect, K in zip(("low spring", "high spring"), SPRINGS.stiffnesses, strict=True):
        assert size_of(calibrated, effect) == pytest.approx(0.01 * K_M / (K + K_M), rel=1e-3)
    assert calibrated.total < printed.total


@pytest.mark.parametrize(("bands", "of"), [("printed", tuple), ("calibrated", after_calibration)])
def test_bands_of_the_table_are_the_moduli_at_both_ends_of_the_error_of_P(bands, of):
    """Both springs add their numerical errors, each in the share of the give that is its own."""
    result = stand_ins.result_of()
    pair, curve = result.pressed.pair, result.press.curve
    modulus_at = force_ratio_curve(pair).modulus_converter(curve.P[:, -1], curve.E)
    for row in (10, 40):
        K_m = curve.E[row] * K_M_OVER_E
        by_springs = sum(error * K_m / (K_m + K) for error, K in zip(ERRORS, SPRINGS.stiffnesses, strict=True))
        numerical = float(curve.P_error[row, -1]) + by_springs
        total = ratio_budget(pair, curve.E[row], curve.x[-1], numerical, of).total
        ends = [modulus_at(curve.P[row, -1] * factor) for factor in (1.0 - total, 1.0 + total)]
        assert getattr(result.errors.reading, bands)[row, -1] == pytest.approx(ends, rel=1e-9, nan_ok=True)
