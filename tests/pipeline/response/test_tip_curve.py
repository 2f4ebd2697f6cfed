"""Large strain in the chain: who is asked, what is kept, what is refused."""

import dataclasses

import numpy as np
import pytest
from stand_ins import CONTACT

import pipeline.response.scene_press
from cad.design.fruit import Fruit
from cad.design.parameters import Design, Targets
from cad.design.reading import Reading
from cad.design.tips import Press, Tips
from cad.quantity import InputError
from cad.theory.deep_press import DeepPress
from cad.theory.two_spring_law import Springs
from pipeline.options import RunOptions
from pipeline.response.scene_press import press_scene, refuse_unsolvable, scene_of, tip_curve
from pipeline.springs.sizing import spring_sizing
from solve.contact.linear_response import spring_compliance
from solve.large_strain.force_curve import force_curve

SPRINGS = Springs(K_l=0.906, K_h=20.83)
C = spring_compliance(*SPRINGS.stiffnesses)
DEEP = Design(press=Press(strain="large"), fruit=Fruit(poisson=0.45))


@pytest.fixture(scope="module")
def press():
    """Return the presses of the default sensor at large strain."""
    return press_scene(DEEP, CONTACT, C)


def test_force_ratio_falls_over_the_travel_as_by_the_table_of_factors(press):
    """The law of two springs with interpolated factors: 0.4 % of a force, on P by both tips, and linear crosstalk."""
    law = DeepPress(springs=SPRINGS, side=1.0, poisson=0.45)
    table = press.table
    for i, E in enumerate(table.E):
        K_m = float(E) * CONTACT.K_m_over_E()
        expected = [law.ratio(K_m, float(x)) for x in table.x]
        np.testing.assert_allclose(table.P[i], expected, rtol=0.008)
    assert 0.01 < np.ptp(table.P[1]) / table.P[1].mean() < 0.05
    assert not press.level
    assert press.tilted == ()


@pytest.mark.parametrize(
    ("NL", "basis", "field"),
    [(0.001, "contact", "targets.NL"), (0.05, "hayes", "--fruit-stiffness")],
)
def test_springs_that_are_not_found_at_large_strain_are_refused(NL, basis, field):
    """The springs of the linear law would miss the targets, and no word of the answer would say so."""
    asked = Design(press=Press(strain="large"), targets=Targets(NL=NL))
    with pytest.raises(InputError) as refused:
        spring_sizing(asked, CONTACT, RunOptions(fruit_stiffness=basis))
    assert refused.value.field == field


def test_linear_press_has_one_ratio_over_the_travel():
    linear = press_scene(dataclasses.replace(DEEP, press=Press()), CONTACT, C)
    assert np.ptp(linear.table.P, axis=1).max() < 1e-12
    assert linear.level


def test_curve_is_solved_once_and_kept(monkeypatch, tmp_path):
    calls = []

    def counted(*args, **kwargs):
        calls.append(args)
        return force_curve(*args, **kwargs)

    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(pipeline.response.scene_press, "force_curve", counted)
    shallow = scene_of(Design(press=Press(strain="large", travel_mm=0.1)))
    first, again = tip_curve(shallow), tip_curve(shallow)
    assert first == again
    assert len(calls) == 1
    tip_curve(scene_of(Design(press=Press(strain="large", travel_mm=0.1), fruit=Fruit(poisson=0.4))))
    assert len(calls) == 2


def test_press_beyond_equilibrium_is_refused_with_the_depth_that_was_reached(monkeypatch, tmp_path):
    def ending(tip, law, deepest):
        curve = force_curve(tip, law, 0.1)
        return dataclasses.replace(curve, asked=deepest)

    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(pipeline.response.scene_press, "force_curve", ending)
    with pytest.raises(InputError) as refused:
        tip_curve(scene_of(Design(press=Press(strain="large"))))
    assert (refused.value.field, refused.value.value) == ("press.travel_mm", 0.6)
    assert refused.value.bound.startswith("at most 0.1 mm")


@pytest.mark.parametrize(
    "change",
    [
        {"reading": Reading()},
        {"press": Press(strain="large", tilt_deg=1.0)},
        {"tips": Tips(shape="sphere")},
        {"fruit": Fruit(shape="sphere", radius_mm=35.0)},
    ],
)
def test_scene_that_large_strain_is_not_solved_for_is_refused_before_anything_is_solved(change, monkeypatch):
    monkeypatch.setattr(pipeline.response.scene_press, "force_curve", None)
    with pytest.raises(InputError) as refused:
        refuse_unsolvable(dataclasses.replace(Design(press=Press(strain="large")), **change))
    assert refused.value.field == "press.strain"
