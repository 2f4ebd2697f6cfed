"""The make-up of error bars: each size by its formula or another method, and nothing left out unsaid."""

import dataclasses
import json
import math
import types

import numpy as np
import pytest
from scipy.optimize import brentq

from cad.design.parameters import Design, Fruit, Press, Print, Targets, Tips
from cad.design.printability import check_printable
from cad.design.processes import PROCESSES
from cad.parts.layout import housing_for
from cad.theory.strain_gauge import FOIL, sandwich_gain
from cad.theory.two_spring_law import Springs, force_ratio, nonlinearity
from pipeline.fit.leaf_lengths import FittedFlexures
from pipeline.stages.sizing import size
from pipeline.stages.springs import PrintedSpring, PrintedSprings
from pipeline.stages.verdict_rules import target_verdicts
from pipeline.stages.verdicts import Case
from pipeline.uncertainty import budget as effects
from pipeline.uncertainty.budget import (
    Effect,
    Makeup,
    NumberError,
    error_makeup,
    flesh_law,
    large_strain,
    makeup,
    no_slip,
)
from pipeline.uncertainty.print_scatter import Surrogate, bands
from solve.fruit.compliance import Compliance
from solve.housing.stiffness import HousingStiffness

CONTACT = Compliance(
    S=((0.766603, 0.010526), (0.010526, 0.766603)), error_percent=0.01, s11_error_percent=0.01,
    method="reference", dofs=0, seconds=0.0, status="given",
)  # fmt: skip
LENGTHS = (28.935, 14.76)
BARS = (0.045, 0.074)


def case_of(**tables):
    design = Design(**tables)
    return Case(design=design, contact=CONTACT, sizing=size(design, CONTACT, "contact"))


def printed_for(case, *, made=True, lengths=LENGTHS):
    """Return the springs of a case as if FE had found just their targets."""
    design, sizing = case.design, case.sizing
    process = PROCESSES[design.print.process]
    K = (sizing.springs.K_l, sizing.springs.K_h)
    deflections = sizing.deflections(design.full_travels_mm)
    housing = housing_for(design, process, lengths, deflections)
    stiffness = HousingStiffness(
        C=np.diag([1.0 / K[0], 1.0 / K[1]]), K=K, error_percent=BARS, strain_per_N=(1e-3, 1e-4),
        strain_error_percent=(1.0, 1.0), tilt_per_N=(0.0, 0.0), dofs=1, seconds=0.0, status="given",
    )  # fmt: skip
    fitted = FittedFlexures(housing=housing, stiffness=stiffness, solves=(1, 1), seconds={})
    verdicts = check_printable(design, sizing.springs, sizing.K_m_max, process)
    low, high = (
        PrintedSpring(
            name=name, target=K[i], printable=verdicts[i],
            stiffness=K[i] if made else None, error_percent=BARS[i] if made else None,
        )
        for i, name in enumerate(("low", "high"))
    )  # fmt: skip
    return PrintedSprings(low=low, high=high, process=process, deflections=deflections, fitted=fitted if made else None)


def response(P, cells):
    return types.SimpleNamespace(cells=cells, responses=[types.SimpleNamespace(E=3.5, P=np.array([1.0, P]))])


LEVEL = response(5.0, 0)
CASE = case_of()
PRINTED = printed_for(CASE)
K_M = 3.5 * CONTACT.K_m_over_E_mm
SPRINGS = CASE.sizing.springs


@pytest.fixture(scope="module")
def found():
    return error_makeup(CASE, PRINTED)


def size_of(error, name, share="model"):
    (size,) = (one.size_percent for one in getattr(error, share) if one.effect == name)
    return 0.01 * size


def test_every_number_says_all_three_shares(found):
    report = makeup(CASE, PRINTED, LEVEL)
    assert json.loads(json.dumps(report, allow_nan=False)).keys() == {"K_l", "K_h", "P_max", "NL", "contact"}
    springs = ["large deflection", "engraved marks", "foot of the print"]
    flesh = ["no slip", "large strain", "law of the flesh"]
    for name, model, inputs in (
        ("K_l", springs, ["modulus", "leaf thickness"]),
        ("K_h", springs, ["modulus", "leaf thickness"]),
        ("P_max", springs + flesh, ["modulus", "leaf thickness", "tip side", "tip edge"]),
        ("NL", springs + flesh, ["modulus", "leaf thickness", "tip side", "tip edge"]),
        ("contact", flesh, ["tip side", "tip edge"]),
    ):
        assert [one["effect"] for one in report[name]["model"]] == model
        assert [one["effect"] for one in report[name]["inputs"]] == inputs
    sizes = [one.size_percent for one in found.K_l.model]
    assert report["K_l"]["model_percent"] == pytest.approx(sum(map(abs, sizes)), rel=1e-12)
    E, t = (one.size_percent for one in found.K_l.inputs)
    assert report["K_l"]["inputs_percent"] == pytest.approx(math.sqrt(E**2 + t**2), rel=1e-12)


def test_discretisation_is_the_bar_that_the_verdicts_use(found):
    judged = CASE.judged(PRINTED.stiffnesses, PRINTED.errors)
    P, NL = target_verdicts(judged, CASE.design.targets)
    assert found.K_l.discretisation_percent == BARS[0]
    assert found.K_h.discretisation_percent == BARS[1]
    assert 0.01 * found.P_max.discretisation_percent * P.value == pytest.approx(P.error, rel=1e-12)
    assert 0.01 * found.NL.discretisation_percent * NL.value == pytest.approx(NL.error, rel=1e-12)
    assert found.contact.discretisation_percent == CONTACT.error_percent


def test_springs_stiffen_by_the_elastica_at_full_travel(found):
    """36/35 (d / L)^2 with d = x K_m / (K_m + K)."""
    for error, K, L in zip((found.K_l, found.K_h), (SPRINGS.K_l, SPRINGS.K_h), LENGTHS, strict=True):
        share = 0.6 * K_M / (K_M + K) / L
        assert size_of(error, "large deflection") == pytest.approx(36.0 / 35.0 * share**2, rel=2e-3)


def test_tilted_sensor_bends_one_spring_more():
    case = case_of(press=Press(tilt_deg=5.0))
    tilted, level = (error_makeup(one, printed_for(one)) for one in (case, CASE))
    assert size_of(tilted.K_h, "large deflection") > 1.5 * size_of(level.K_h, "large deflection")
    for name in ("K_l", "P_max"):  # P_max is a level sensor's
        before, after = (size_of(getattr(error, name), "large deflection") for error in (level, tilted))
        assert after == pytest.approx(before, rel=1e-12)


def equilibrium(E, stiffening):
    """Return P of springs F = K (1 + c (d / L)^2) d on fruit of modulus E pressed by 0.6 mm."""
    K_m = E * CONTACT.K_m_over_E_mm
    forces = []
    for K, L in zip((SPRINGS.K_l, SPRINGS.K_h), LENGTHS, strict=True):
        d = brentq(
            lambda d, K=K, L=L: K * (1.0 + stiffening * (d / L) ** 2) * d - K_m * (0.6 - d), 0.0, 0.6, xtol=1e-15
        )
        forces.append(K_m * (0.6 - d))
    return forces[1] / forces[0]


def test_large_deflection_in_P_and_NL_is_that_of_springs_in_balance(found):
    """Forces by a root of the balance, at the middle and at the top of the range; 1 %: stiffer springs bend less."""
    (soft, stiff), (middle, most) = ([equilibrium(E, c) for E in (1.75, 3.5)] for c in (0.0, 36.0 / 35.0))
    assert size_of(found.P_max, "large deflection") == pytest.approx(most / stiff - 1.0, rel=0.01)
    change = (middle - 1.0) / (most - 1.0) - (soft - 1.0) / (stiff - 1.0)
    assert size_of(found.NL, "large deflection") == pytest.approx(change / 0.05, rel=0.01)


def test_flesh_in_P_and_NL_is_that_of_another_fruit(found):
    """Grip makes the fruit stiffer everywhere by the same share: the law at as much larger K_m."""
    stiffer = (1.0 + no_slip(0.3)) * K_M
    assert size_of(found.P_max, "no slip") == pytest.approx(force_ratio(SPRINGS, stiffer) / 5.0 - 1.0, rel=1e-6)
    assert size_of(found.NL, "no slip") == pytest.approx(nonlinearity(SPRINGS, stiffer) / 0.05 - 1.0, rel=1e-6)
    assert size_of(found.contact, "no slip") == pytest.approx(1.0 / (1.0 + no_slip(0.3)) - 1.0, rel=1e-12)


@pytest.mark.parametrize("definition", ["mid-range", "largest"])
def test_inputs_go_through_the_law_with_both_springs_at_once(definition):
    case = case_of(targets=Targets(NL_definition=definition))
    K, error = case.sizing.springs, error_makeup(case, printed_for(case))
    up, down = (Springs(K_l=K.K_l * (1.0 + e), K_h=K.K_h * (1.0 + e)) for e in (0.2, -0.2))  # two sigma of 10 %
    P = 0.5 * (force_ratio(down, K_M) - force_ratio(up, K_M)) / 5.0
    assert size_of(error.P_max, "modulus", "inputs") == pytest.approx(P, rel=1e-9)
    NL = 0.5 * (nonlinearity(down, K_M, definition) - nonlinearity(up, K_M, definition)) / 0.05
    # The place of the largest departure moves with the springs, which a fixed place leaves out.
    rel = 1e-9 if definition == "mid-range" else 0.02
    assert size_of(error.NL, "modulus", "inputs") == pytest.approx(NL, rel=rel)


def test_inputs_are_those_of_the_sampled_bands():
    """Half the middle 95 % of 1024 prints, with the same slopes, is 1.96 sigma of modulus and thickness together."""
    slopes, judged = (2.87, 2.57), CASE.judged(PRINTED.stiffnesses)
    error = error_makeup(CASE, PRINTED, slopes)
    surrogate = Surrogate(slopes=slopes, curves=(0.0, 0.0), corner_error=0.0)
    sampled = bands(PRINTED.housing, PRINTED.process, judged, CASE.design.targets, surrogate)
    for number, band, value in ((error.P_max, sampled.P_max, 5.0), (error.NL, sampled.NL, 0.05)):
        both = math.hypot(size_of(number, "modulus", "inputs"), size_of(number, "leaf thickness", "inputs"))
        assert both * value * 1.96 / 2.0 == pytest.approx(0.5 * (band[1] - band[0]), rel=0.05)


def test_grip_is_the_share_that_the_shared_study_has():
    assert [round(100.0 * no_slip(nu), 1) for nu in (0.3, 0.45)] == [2.9, 0.3]
    assert no_slip(0.0) == pytest.approx(math.log(3.0) - 1.0, rel=1e-12)


def test_large_strain_is_the_share_that_the_shared_study_has():
    """Within 0.8, 4.8, 5.5 % up to 0.6 sides; laws apart by 2.4, 6, 9 % at 0.1, 0.3, 0.6."""
    assert [large_strain(0.6, nu) for nu in (0.3, 0.45, 0.49)] == pytest.approx([0.008, 0.048, 0.055])
    assert [flesh_law(depth) for depth in (0.0, 0.1, 0.3, 0.6, 1.2)] == pytest.approx([0.0, 0.024, 0.06, 0.09, 0.18])
    assert large_strain(0.15, 0.3) == pytest.approx(0.004)


def test_foot_of_the_print_is_the_share_that_the_shared_study_has():
    """0.15 mm x 0.2 mm on leaves 0.8 and 1.2 thick, 6 deep: +5 and +3 %."""
    case = case_of()
    housing = PRINTED.housing
    flat = dataclasses.replace(
        housing, low=dataclasses.replace(housing.low, depth=6.0), high=dataclasses.replace(housing.high, depth=6.0)
    )
    printed = dataclasses.replace(PRINTED, fitted=dataclasses.replace(PRINTED.fitted, housing=flat))
    error = error_makeup(case, printed, (2.87, 2.57))
    assert [round(100.0 * size_of(one, "foot of the print")) for one in (error.K_l, error.K_h)] == [5, 3]


def test_marks_take_at_most_their_depth_from_the_frame(found):
    """The frame's 0.08 and 0.6 % of 1/K, as K / (E w) goes, by 0.3 of the 9.7 mm that are left."""
    for error, K, share, known in ((found.K_l, SPRINGS.K_l, 8e-4, 0.753), (found.K_h, SPRINGS.K_h, 6e-3, 17.3)):
        here = share * (K / known) * 6.0 / 10.0
        assert size_of(error, "engraved marks") == pytest.approx(-here * 0.3 / 9.7, rel=1e-9)


def test_sintered_print_has_no_foot():
    case = case_of(print=Print(process="sls-pa12"))
    error = error_makeup(case, printed_for(case))
    assert "foot of the print" not in [one.effect for one in error.K_l.model]


@pytest.mark.parametrize("travel", [1e-3, 1e-7])
def test_effect_far_below_round_off_keeps_its_size(travel):
    """The bend goes with the travel squared, down to shares that P itself cannot hold."""
    case = case_of(press=Press(travel_mm=travel))
    small, large = (error_makeup(one, printed_for(one)) for one in (case, CASE))
    for name in ("P_max", "NL"):
        before, after = (size_of(getattr(error, name), "large deflection") for error in (large, small))
        assert after == pytest.approx(before * (travel / 0.6) ** 2, rel=2e-3)


def test_springs_that_are_not_made_have_no_error_of_their_own():
    error = error_makeup(CASE, printed_for(CASE, made=False))
    assert (error.K_l, error.K_h) == (None, None)
    assert [one.effect for one in error.P_max.model] == ["no slip", "large strain", "law of the flesh"]
    assert makeup(CASE, printed_for(CASE, made=False), LEVEL)["K_l"] is None


@pytest.mark.parametrize(
    "tables",
    [
        {"press": Press(travel_mm=5.0)},
        {"targets": Targets(P_max=1.05)},
        {"targets": Targets(P_max=50.0, NL=0.2, NL_definition="largest")},
        {"fruit": Fruit(poisson=0.4999)},
        {"press": Press(tilt_deg=-15.0)},
        {"print": Print(process="dmls-17-4ph")},
    ],
    ids=str,
)
def test_hard_designs_have_finite_shares(tables):
    case = case_of(**tables)
    json.dumps(makeup(case, printed_for(case), LEVEL), allow_nan=False)


def test_forgotten_effect_is_refused(monkeypatch):
    monkeypatch.setattr(effects, "large_deflection_stiffening", lambda _length, _deflection: 0.0)
    with pytest.raises(ValueError, match=r"effect 'large deflection' = .* %.*: must have a name, a finite size"):
        error_makeup(CASE, PRINTED)


@pytest.mark.parametrize("change", [{"size_percent": 0.0}, {"size_percent": math.nan}, {"reason": ""}, {"effect": ""}])
def test_effect_without_size_name_or_reason_is_refused(change):
    whole = {"effect": "tilt", "size_percent": 0.1, "reason": "measured"}
    Effect(**whole)
    with pytest.raises(ValueError, match=r"must have a name, a finite size other than 0 and a reason; compute it"):
        Effect(**{**whole, **change})


@pytest.mark.parametrize("change", [{"discretisation_percent": 0.0}, {"model": ()}, {"inputs": ()}])
def test_number_with_an_empty_share_is_refused(change, found):
    with pytest.raises(ValueError, match=r"must be greater than 0 and at least one of each; complete the make-up"):
        dataclasses.replace(found.P_max, **change)


def test_missing_number_is_refused(found):
    known = vars(found)
    for name in known:
        with pytest.raises(TypeError, match=f"missing 1 required keyword-only argument: '{name}'"):
            Makeup(**{key: value for key, value in known.items() if key != name})
    assert all(isinstance(one, NumberError) for one in known.values())


def test_ground_pins_have_the_edges_and_sides_of_ground_bar():
    case = case_of(tips=Tips(socket="pin"))
    error = error_makeup(case, printed_for(case))
    assert size_of(error.contact, "tip edge", "inputs") == pytest.approx(0.018, rel=1e-3)
    assert size_of(error.contact, "tip side", "inputs") == pytest.approx(0.01, rel=1e-3)


def test_scene_that_is_not_level_adds_how_far_its_own_force_ratio_lies():
    added = makeup(CASE, PRINTED, response(4.0, 80))["P_max"]["model"][-1]
    assert (added["effect"], added["size_percent"]) == ("shape and pose", pytest.approx(-20.0, abs=0.01))
    for other in (LEVEL, response(math.nan, 80)):
        assert makeup(CASE, PRINTED, other)["P_max"]["model"][-1]["effect"] != "shape and pose"


def test_gauges_add_what_their_glue_leaves_open():
    case = case_of(print=Print(gauges="foil"))
    error = error_makeup(case, printed_for(case))
    leaf = printed_for(case).housing.low
    gain = sandwich_gain(2000.0, (leaf.depth, leaf.thickness), leaf.length, leaf.fillet, FOIL)
    assert size_of(error.K_l, "gauges", "inputs") == pytest.approx(0.25 * (1.0 - 1.0 / gain))
    assert 0.02 < size_of(error.K_l, "gauges", "inputs") < 0.06


@pytest.mark.parametrize("travel", [1e-160, 5.0])
def test_any_travel_has_a_make_up(travel):
    case = case_of(press=Press(travel_mm=travel))
    assert json.dumps(makeup(case, printed_for(case), LEVEL), allow_nan=False)
