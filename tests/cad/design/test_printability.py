import dataclasses
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cad.design.fruit import Fruit
from cad.design.parameters import Design, GivenSprings, Print, Targets
from cad.design.printability import NEAREST_MARGIN, SHORTEST, STRAIN_FACTOR, check_printable
from cad.design.processes import PROCESSES
from cad.design.tips import Press, Tips
from cad.theory.leaf_spring import pair_length, pair_stiffness
from cad.theory.two_spring_law import Springs, size_springs

K_M = 4.6292  # [N/mm], the paper's block at 3.5 MPa
PETG = PROCESSES["fdm-petg"]
STEEL = PROCESSES["dmls-17-4ph"]


def _design(longest=120.0, travel=0.6, tilt=0.0, **targets):
    return Design(
        targets=Targets(**targets), print=Print(max_length_mm=longest), press=Press(travel_mm=travel, tilt_deg=tilt)
    )


def _sized(design):
    targets = design.targets
    return size_springs(targets.P_max, targets.NL, K_M, targets.NL_definition)


def _verdicts(design, process=PETG, lengths=None):
    found = check_printable(design, _sized(design), K_M, process, lengths)
    assert [one.name for one in found] == ["printable.low", "printable.high"]
    for one in found:
        assert len(one.reason.splitlines()) == 1
    return found


@pytest.mark.parametrize("process", PROCESSES.values(), ids=PROCESSES)
@pytest.mark.parametrize("definition", ["mid-range", "largest"])
def test_every_process_can_make_the_paper_design(process, definition):
    for verdict in _verdicts(_design(NL_definition=definition), process):
        assert verdict.passed is True
        assert verdict.nearest is None
        assert verdict.reason == f"{process.name} can make the {verdict.name[10:]} leaf"
        assert verdict.shortest_mm < verdict.length_mm < verdict.longest_mm


def test_numbers_are_those_of_the_beam_law():
    design = _design()
    low, high = _verdicts(design)
    springs = _sized(design)
    for verdict, K, t in ((low, springs.K_l, 0.8), (high, springs.K_h, 1.2)):
        assert pair_stiffness(PETG.E_MPa, PETG.depth_mm, t, verdict.length_mm) == pytest.approx(K)
        assert verdict.stiffness_N_per_mm == K
        assert verdict.shortest_mm == SHORTEST * t
        deflection = 0.6 * K_M / (K_M + K)  # spring and fruit in series share the travel
        strain = STRAIN_FACTOR * 3.0 * t * deflection / verdict.length_mm**2
        assert verdict.root_strain == pytest.approx(strain)


@pytest.mark.parametrize("definition", ["mid-range", "largest"])
def test_high_leaf_too_short_names_NL_and_the_nearest_NL(definition):
    low, high = _verdicts(_design(NL=0.001, NL_definition=definition))
    assert low.passed is True
    assert high.passed is False
    assert high.target == "targets.NL"
    expected = (
        f"targets.NL = 0.001: asks fdm-petg for a leaf {high.length_mm:.1f} mm long, must be at least 5 thicknesses = "
        f"6 mm; the nearest NL that it can make is {high.nearest:g}, or choose another process"
    )
    assert high.reason == expected
    K = pair_stiffness(PETG.E_MPa, PETG.depth_mm, 1.2, 6.0 * (1.0 + NEAREST_MARGIN))
    r = K_M / K
    exact = r / (4.0 + 2.0 * r) if definition == "mid-range" else math.tanh(0.25 * math.log1p(r))
    assert exact <= high.nearest < exact + 1.01e-4  # the next of the steps of 1e-4


@pytest.mark.parametrize("definition", ["mid-range", "largest"])
def test_low_leaf_too_long_names_P_max_and_the_nearest_P_max(definition):
    design = _design(P_max=90.0, NL_definition=definition)
    low, high = _verdicts(design, STEEL)
    assert high.passed is True
    assert low.passed is False
    assert low.target == "targets.P_max"
    assert "targets.P_max = 90: asks dmls-17-4ph for a leaf" in low.reason
    assert "must be at most print.max_length_mm = 120 mm; the nearest P_max that it can make is" in low.reason
    K = pair_stiffness(STEEL.E_MPa, STEEL.depth_mm, 0.5, 120.0 / (1.0 + NEAREST_MARGIN))
    exact = (K_M / K + 1.0) / (1.0 + K_M / _sized(design).K_h)  # (10) for P_max
    assert exact - 0.1 <= low.nearest <= exact


@given(
    P_max=st.floats(1.02, 100.0), NL=st.floats(0.0005, 0.49), definition=st.sampled_from(["mid-range", "largest"]),
    process=st.sampled_from(list(PROCESSES.values())), longest=st.floats(15.0, 120.0), travel=st.floats(0.1, 6.0),
)  # fmt: skip
def test_nearest_target_can_be_made_and_a_passed_leaf_is_inside_every_bound(
    P_max, NL, definition, process, longest, travel
):
    design = _design(longest, travel, P_max=P_max, NL=NL, NL_definition=definition)
    low, high = _verdicts(design, process)
    for verdict, key in ((low, "P_max"), (high, "NL")):
        if verdict.passed is True:
            assert verdict.shortest_mm <= verdict.length_mm <= longest
            assert verdict.root_strain <= process.strain_limit
        elif verdict.nearest is not None:
            nearer = dataclasses.replace(design, targets=dataclasses.replace(design.targets, **{key: verdict.nearest}))
            index = 0 if key == "P_max" else 1
            assert _verdicts(nearer, process)[index].passed is True
            assert f"{verdict.nearest:g}" in verdict.reason
        else:
            assert f"no {key} helps" in verdict.reason


def test_leaf_near_a_bound_waits_for_its_solved_length():
    length = pair_length(PETG.E_MPa, PETG.depth_mm, 0.8, _sized(_design()).K_l)
    design = _design(longest=1.05 * length)
    low, high = _verdicts(design)
    assert low.passed is None
    assert "near enough (15% of length) that only the solved length decides" in low.reason
    assert _verdicts(design, lengths=(1.04 * length, high.length_mm))[0].passed is True
    solved = _verdicts(design, lengths=(1.06 * length, high.length_mm))[0]
    assert solved.passed is False
    assert solved.length_mm == 1.06 * length


def test_leaf_thinner_than_the_wall_fails_whatever_the_target():
    thin = dataclasses.replace(PETG, leaf_thickness_low_mm=0.4)
    low, high = _verdicts(_design(), thin)
    assert high.passed is True
    assert (low.passed, low.nearest) == (False, None)
    assert (
        "a leaf 0.4 mm thick, must be at least the wall of 0.8 mm; no P_max helps, choose another process" in low.reason
    )


def test_strain_over_the_limit_fails_and_tilt_moves_it():
    brittle = dataclasses.replace(PETG, strain_limit=0.002)
    low, _ = _verdicts(_design(travel=1.5), brittle)
    assert low.passed is False
    assert "must be at most 0.002 of PETG" in low.reason
    level, tilted = (_verdicts(_design(tilt=tilt)) for tilt in (0.0, 3.0))
    rise = 4.0 * math.tan(math.radians(3.0)) / 0.6  # half the spacing, over the travel
    assert tilted[1].root_strain == pytest.approx((1.0 + rise) * level[1].root_strain)
    assert tilted[0].root_strain == pytest.approx((1.0 - rise) * level[0].root_strain)


def test_tip_wider_than_the_plate_makes_the_leaves_as_deep_as_itself():
    design = dataclasses.replace(_design(), tips=Tips(side_mm=11.0, spacing_mm=12.0), fruit=Fruit(length_mm=30.0))
    low, _ = _verdicts(design)
    assert pair_stiffness(PETG.E_MPa, 11.0, 0.8, low.length_mm) == pytest.approx(_sized(design).K_l)


def test_given_springs_are_answered_in_their_own_unit():
    design = dataclasses.replace(_design(), springs=GivenSprings(K_l_N_per_m=753.0, K_h_N_per_m=1e6))
    low, high = check_printable(design, Springs(K_l=0.753, K_h=1000.0), K_M, PETG)
    assert low.passed is True
    assert high.passed is False
    assert high.reason.startswith("springs.K_h_N_per_m = 1e+06 N/m: asks fdm-petg for a leaf")
    K = 1e3 * pair_stiffness(PETG.E_MPa, PETG.depth_mm, 1.2, 6.0 * (1.0 + NEAREST_MARGIN))
    assert K / 10.0 ** (1.0 / 200.0) * 0.99 <= high.nearest <= K
    assert f"the nearest K_h_N_per_m that it can make is {high.nearest:g} N/m" in high.reason


def test_nearest_target_is_what_would_be_sized_and_not_moved_by_moduli_beyond_the_range():
    """The targets size the springs at E_max; a modulus shown beyond it bends them further and no more."""
    K_m, short = 4.629, Print(max_length_mm=20.0)
    springs = size_springs(5.0, 0.05, K_m)
    plain, beyond = (
        check_printable(Design(fruit=fruit, print=short), springs, K_m, PETG)[0]
        for fruit in (Fruit(), Fruit(E_MPa=(1.0, 7.0)))
    )
    assert beyond.nearest == plain.nearest
    assert beyond.root_strain > plain.root_strain


@pytest.mark.parametrize("q", [0.9, 1.2])
def test_nearest_target_off_the_middle_is_one_that_can_be_made_there(q):
    K_m, design = 4.629, Design(print=Print(max_length_mm=20.0))
    found = check_printable(design, size_springs(5.0, 0.05, K_m, "mid-range", q), K_m, PETG, stiffness_ratio=q)[0]
    assert found.passed is False
    made = size_springs(found.nearest, 0.05, K_m, "mid-range", q)
    assert pair_length(PETG.E_MPa, PETG.depth_mm, PETG.leaf_thickness_low_mm, made.K_l) * (1.0 + NEAREST_MARGIN) <= 20.0
    other = dataclasses.replace(design, targets=Targets(P_max=found.nearest, NL=0.05))
    assert check_printable(other, made, K_m, PETG, stiffness_ratio=q)[0].passed is True
