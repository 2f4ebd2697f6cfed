import dataclasses
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sensor.design.fruit import Fruit
from sensor.design.parameters import Design, GivenSprings, Print, Targets
from sensor.design.printability import FILLET_STRAIN, SHORTEST_LEAF, check_printable
from sensor.design.processes import PROCESSES
from sensor.design.tips import PressMotion, Tips
from sensor.theory.leaf_spring import pair_length, pair_stiffness
from sensor.theory.two_spring_law import Springs, size_springs

K_M = 4.6292  # [N/mm], the paper's block at 3.5 MPa
PETG = PROCESSES["fdm-petg"]


def _design(longest=120.0, travel=0.6, tilt=0.0, **targets):
    return Design(
        targets=Targets(**targets),
        print=Print(max_length_mm=longest),
        press=PressMotion(travel_mm=travel, tilt_deg=tilt),
    )


def _sized(design):
    targets = design.targets
    return size_springs(targets.P_max, targets.NL, K_M, targets.NL_definition)


def _verdicts(design, process=PETG, lengths=None):
    """Return the verdicts on the springs of a design in a process, which is its own where it is no known one."""
    own = None if PROCESSES[process.name] == process else dataclasses.replace(process, name="own")
    named = dataclasses.replace(design.print, process="own" if own else process.name)
    design = dataclasses.replace(design, print=named, printer=own)
    found = check_printable(design, _sized(design), K_M, lengths)
    assert [one.name for one in found] == ["printable.low", "printable.high"]
    return found


@pytest.mark.parametrize("process", PROCESSES.values(), ids=PROCESSES)
@pytest.mark.parametrize("definition", ["mid-range", "largest"])
def test_every_process_can_make_the_paper_design(process, definition):
    for verdict in _verdicts(_design(NL_definition=definition), process):
        assert verdict.passed is True
        assert verdict.shortest_mm < verdict.length_mm < verdict.longest_mm


def test_numbers_are_those_of_the_beam_law_and_strain_is_that_of_the_stiffest_fruit_shown():
    design = _design()
    springs = _sized(design)
    beyond = dataclasses.replace(design, fruit=Fruit(E_MPa=(1.0, 7.0)))
    for scene, K_m in ((design, K_M), (beyond, 2.0 * K_M)):
        for verdict, K, t in zip(_verdicts(scene), springs.stiffnesses, (0.8, 1.2), strict=True):
            assert pair_stiffness(PETG.E_MPa, PETG.depth_mm, t, verdict.length_mm) == pytest.approx(K)
            assert verdict.shortest_mm == SHORTEST_LEAF * t
            deflection = 0.6 * K_m / (K_m + K)  # spring and fruit in series share the travel
            strain = FILLET_STRAIN * 3.0 * t * deflection / verdict.length_mm**2
            assert verdict.root_strain == pytest.approx(strain)


@pytest.mark.parametrize(
    ("changes", "process", "index", "asks"),
    [
        ({"NL": 0.001}, {}, 1, ("targets.NL = 0.001: asks", "at least 5 thicknesses = 6 mm")),
        ({"P_max": 90.0, "longest": 40.0}, {}, 0, ("targets.P_max = 90: asks", "print.max_length_mm = 40 mm")),
        ({}, {"leaf_thickness_low_mm": 0.4}, 0, ("a leaf 0.4 mm thick, must be at least the wall of 0.8 mm",)),
        ({"travel": 1.5}, {"strain_limit": 0.002}, 0, ("must be at most 0.002 of PETG",)),
    ],
)
def test_leaf_beyond_a_bound_fails_and_names_what_asks_for_it(changes, process, index, asks):
    failed = _verdicts(_design(**changes), dataclasses.replace(PETG, **process))[index]
    assert failed.passed is False
    assert all(part in failed.reason for part in asks)


@given(
    P_max=st.floats(1.02, 100.0), NL=st.floats(0.0005, 0.49), definition=st.sampled_from(["mid-range", "largest"]),
    process=st.sampled_from(list(PROCESSES.values())), longest=st.floats(15.0, 120.0), travel=st.floats(0.1, 6.0),
)  # fmt: skip
def test_a_leaf_passes_just_where_it_is_inside_every_bound(P_max, NL, definition, process, longest, travel):
    design = _design(longest, travel, P_max=P_max, NL=NL, NL_definition=definition)
    lengths = tuple(verdict.length_mm for verdict in _verdicts(design, process))
    for verdict in _verdicts(design, process, lengths):
        is_inside = verdict.shortest_mm <= verdict.length_mm <= longest and verdict.root_strain <= process.strain_limit
        assert verdict.passed is is_inside


def test_leaf_near_a_bound_waits_for_its_solved_length():
    length = pair_length(PETG.E_MPa, PETG.depth_mm, 0.8, _sized(_design()).K_l)
    design = _design(longest=1.05 * length)
    low, high = _verdicts(design)
    assert low.passed is None
    assert _verdicts(_design(longest=1.16 * length))[0].passed is True
    assert _verdicts(_design(longest=0.86 * length))[0].passed is False
    assert _verdicts(design, lengths=(1.04 * length, high.length_mm))[0].passed is True
    solved = _verdicts(design, lengths=(1.06 * length, high.length_mm))[0]
    assert (solved.passed, solved.length_mm) == (False, 1.06 * length)


def test_tilt_moves_the_strain_of_both_springs():
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
    low, high = check_printable(design, Springs(K_l=0.753, K_h=1000.0), K_M)
    assert low.passed is True
    assert high.passed is False
    assert high.reason.startswith("springs.K_h_N_per_m = 1e+06 N/m: asks fdm-petg for a leaf")
