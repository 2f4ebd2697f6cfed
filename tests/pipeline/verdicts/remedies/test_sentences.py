"""Every verdict that did not pass has a remedy in words, whose numbers make the design pass."""

import dataclasses
import functools
import shlex

import pytest
from stand_ins import GOOD, result_of, springs_of

from cad.design.fruit import Fruit
from cad.design.parameters import Design, GivenSprings, Print, Targets
from cad.quantity import Estimate
from pipeline.options import RunOptions, load_design
from pipeline.verdicts.remedies.own import own_remedy, own_travel
from pipeline.verdicts.remedies.sentences import with_remedies
from pipeline.verdicts.remedies.trial import Trials

BRUISED = Design(fruit=Fruit(bruise_limit_MPa=0.29))
ROUGH = RunOptions(tolerance=0.02)


def settings_in(remedy):
    words = shlex.split(remedy[remedy.index("--set") :])
    return dict(word.split("=", 1) for word in words if word != "--set")


@functools.cache
def verdicts_of(design, *, made=True):
    """Return the verdicts of a stand-in result, each with its remedy."""
    return with_remedies(result_of(design, made=made))


def test_design_that_passes_needs_no_remedy():
    result = result_of()
    assert with_remedies(result) == result.verdicts


@pytest.mark.parametrize(
    ("design", "made"),
    [
        (BRUISED, True),
        (Design(springs=GivenSprings(K_l_N_per_m=753.0, K_h_N_per_m=17300.0)), True),
        (Design(targets=Targets(NL=0.001)), False),
        (Design(print=Print(process="dmls-17-4ph", max_length_mm=35.0)), False),
    ],
    ids=["bruised", "given springs", "NL out of reach", "process"],
)
def test_every_verdict_that_did_not_pass_has_a_remedy_that_mends_the_design(design, made):
    verdicts = verdicts_of(design, made=made)
    wrong = [verdict for verdict in verdicts if verdict.passed is not True]
    assert wrong
    for verdict in verdicts:
        assert (verdict.remedy is None) == (verdict.passed is True)
    preset = {
        "fruit.bruise_limit_MPa": design.fruit.bruise_limit_MPa,
        "targets.NL": design.targets.NL,
        "print.process": design.print.process,
        "print.max_length_mm": design.print.max_length_mm,
        "springs.K_l_N_per_m": design.springs.K_l_N_per_m,
        "springs.K_h_N_per_m": design.springs.K_h_N_per_m,
    }
    mended = load_design("paper", {**preset, **settings_in(wrong[0].remedy)})
    assert Trials(100)(mended).passes


def test_bound_is_told_with_its_side():
    (verdict,) = (v for v in verdicts_of(BRUISED, made=True) if v.name == "bruise")
    assert verdict.remedy.startswith("passes with press.travel_mm at most 0.0")


def test_springs_sized_by_another_formula_are_mended_by_the_contact():
    result = result_of(options=RunOptions(fruit_stiffness="hayes"))
    failed = dataclasses.replace(result, verdicts=(dataclasses.replace(GOOD, name="P_max", passed=False),))
    assert "--fruit-stiffness contact" in with_remedies(failed)[0].remedy


def test_error_bar_is_mended_by_a_tolerance():
    open_ = dataclasses.replace(GOOD, name="K_l", limit=900.0, tolerance=0.001, relative=True, error=9.0, passed=None)
    springs = springs_of(Design())
    assert own_remedy(open_, Design(), springs, ROUGH) == "undecided by its error bar, --tol 0.0005 would decide"
    gauged = dataclasses.replace(springs.fitted.housing, gauges="foil")
    fitted = dataclasses.replace(springs.fitted, housing=gauged)
    assert own_remedy(open_, Design(), dataclasses.replace(springs, fitted=fitted), ROUGH) is None


def test_strain_by_finite_elements_is_mended_by_less_travel():
    """Strain goes with the travel: 1.1 times its limit, and an error of 0.1 times, ask for 0.6 mm / 1.2."""
    springs = springs_of(Design())
    limit = springs.springs[0].printable.strain_limit
    bent = dataclasses.replace(springs.springs[0], root_strain=Estimate(1.1 * limit, 0.1 * limit))
    bent_springs = dataclasses.replace(springs, springs=(bent, springs.springs[1]))
    verdict = dataclasses.replace(GOOD, name="printable.low", passed=False)
    assert own_travel(verdict, Design(), bent_springs) == pytest.approx(0.6 / 1.2, rel=0.03)
    assert own_travel(verdict, Design(), bent_springs) < 0.6 / 1.2


def test_frame_on_the_fruit_is_mended_by_less_travel():
    """0.2 mm short of its clearance at a travel of 0.6 mm: 0.4 mm at most."""
    touching = dataclasses.replace(GOOD, name="geometry.frame_clearance", value=0.1, limit=0.3, passed=False)
    springs = springs_of(Design())
    assert 0.38 < own_travel(touching, Design(), springs) < 0.4
    beyond = dataclasses.replace(touching, value=-1.0)
    assert own_travel(beyond, Design(), springs) is None


def test_remedy_that_is_none_names_what_was_tried():
    """No key of this design bears on a solid with a hole."""
    failed = dataclasses.replace(
        result_of(), verdicts=(dataclasses.replace(GOOD, name="geometry.valid", passed=False),)
    )
    remedy = with_remedies(failed)[0].remedy
    assert remedy.startswith("none found: with ideal springs all passes, and no key is known to mend geometry.valid")
