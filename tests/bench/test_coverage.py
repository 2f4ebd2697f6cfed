"""Ten random scenes of the coverage script, judged by the next finer mesh; and planted errors that it sees."""

import dataclasses
import types
from pathlib import Path

import pytest
from scripts import loaded_script
from skfem import ElementHex1

import solve.fruit.remainder
from cad.quantity import InputError
from mesh.housing.sweep import flexure_mesh
from pipeline.bench.hard import contact as hard_contact
from pipeline.bench.hard import flexure as hard_flexure
from solve.fruit.curved_body import shape_change
from solve.fruit.split import LARGEST_ERROR, LEVELS, tip_footprints
from solve.housing.stiffness import tip_compliance

SCRIPT = Path(__file__).with_name("coverage.py")


@pytest.fixture(scope="module")
def coverage():
    return loaded_script(SCRIPT)


@pytest.fixture
def quick(monkeypatch):
    """Judge by about twice the dofs instead of four times, and the coarsest level only."""
    monkeypatch.setattr(hard_contact, "FINER", (dataclasses.replace(LEVELS[1], step=0.57),))
    monkeypatch.setattr(hard_contact, "FOUR_TIMES", 1.0)


@pytest.fixture
def check(coverage):
    def make(**changed):
        whole = {"name": "s", "value": 1.0, "error": 1e-3, "reference": 1.0005, "reference_error": 0.0}
        return coverage.ReferenceCheck(**{**whole, "source": "formula", **changed})

    return make


@pytest.mark.slow
@pytest.mark.usefixtures("quick")
def test_ten_random_scenes_lie_inside_their_bars(coverage):
    for found in coverage.contact_coverage(10, 3, 0.0, LARGEST_ERROR):
        assert len(found.checks) == 10
        assert found.holds
        zero = dataclasses.replace(found, checks=tuple(dataclasses.replace(one, error=0.0) for one in found.checks))
        assert not zero.holds


@pytest.mark.slow
@pytest.mark.usefixtures("quick")
def test_scenes_at_a_loose_tolerance_lie_inside_their_bars(coverage):
    for found in coverage.contact_coverage(5, 3, 0.0, 0.02):
        assert len(found.checks) == 5
        assert found.holds


@pytest.mark.usefixtures("quick", "wrong_traction")
def test_a_wrong_sign_in_a_traction_does_not_hold(coverage):
    for found in coverage.contact_coverage(3, 3, 0.0, LARGEST_ERROR):
        assert (len(found.checks), len(found.refused)) == (0, 3)
        assert not found.holds


@pytest.mark.usefixtures("quick")
def test_a_mesh_at_order_1_does_not_hold(coverage, monkeypatch):
    monkeypatch.setattr(solve.fruit.remainder, "ElementHex2", ElementHex1)
    assert not any(found.holds for found in coverage.contact_coverage(5, 3, 0.0, 0.02))


def test_refusals_count_where_an_answer_is_promised_and_those_of_the_reference_nowhere(coverage, check):
    assert coverage.Covered("s", (check(),), ("no",)).holds
    assert not coverage.Covered("s", (check(),), ("no",), promised=True).holds
    assert not coverage.Covered("s", (), ("no",)).holds
    alone = check(reference=None)
    assert coverage.Covered("s", (check(), alone), (), promised=True).holds
    assert not coverage.Covered("s", (alone,), ()).holds


@pytest.mark.parametrize(
    ("factor", "bar", "holds"), [(1.0, 2e-3, True), (1.01, 2e-3, False), (1.0, 0.0, False)],
    ids=["as it is", "spring 1 % off", "bar of zero"],
)  # fmt: skip
def test_flexures_take_turns_and_planted_errors_are_seen(factor, bar, holds, coverage, monkeypatch):
    """Judged and judging mesh are the same coarse one here, to be quick."""
    monkeypatch.setattr(hard_flexure, "FINER", 4.0)

    def judged(_pair, housing, E, poisson):
        K_l, K_h = tip_compliance(flexure_mesh(housing, 4.0), E, poisson).K
        return types.SimpleNamespace(stiffness=types.SimpleNamespace(K=(factor * K_l, K_h), error=(bar, bar)))

    monkeypatch.setattr(hard_flexure, "solve_on", judged)
    found = coverage.flexure_coverage(1, 1)
    assert [one.name for one in found] == ["flexure K_l, K_h, --tol 0.001", "flexure K_l, K_h, --tol 0.01"]
    assert [(len(one.checks), one.holds) for one in found] == [(2, holds), (2, holds)]


@pytest.mark.slow
@pytest.mark.parametrize(("off", "holds"), [(0.0, True), (5e-3, False)], ids=["as it is", "0.5 % off"])
def test_curved_bodies_are_judged_by_what_a_solid_says(off, holds, coverage, monkeypatch):
    """The solid is stood in for by the bent mesh of the product, so that the check is quick."""

    def judged(fruit, tips, _size):
        change = shape_change(fruit, tip_footprints(tips)).change
        whole = 1.0 / tips.side_mm
        return change[0, 0] - change[0, 1] + off * whole

    monkeypatch.setattr(coverage, "solid_change", judged)
    (found,) = coverage.curved_coverage(2, 5)
    assert len(found.checks) == 2
    assert found.holds == holds


def test_every_process_that_can_be_made_takes_its_turn(coverage, check, monkeypatch):
    asked = []

    def guess(design):
        asked.append(design.print.process)
        if len(asked) == 1:
            msg = "must be refused once; the same process is drawn again"
            raise InputError(msg)
        return None, None

    monkeypatch.setattr(coverage, "beam_guess", guess)
    monkeypatch.setattr(coverage, "stiffness_checks", lambda *_: (check(),) * 4)
    found = coverage.flexure_coverage(6, 1)
    assert asked == ["fdm-petg", "fdm-petg", "fdm-pla", "sls-pa12", "sla-resin", "dmls-17-4ph", "dmls-ti64"]
    assert [(len(one.checks), len(one.refused)) for one in found] == [(12, 1), (12, 1)]


def test_page_has_a_row_for_each_number(coverage, check, monkeypatch, tmp_path):
    alone = check(value=0.0, reference=None)
    both = (check(), check(reference=1.004, reference_error=2.008e-3), alone)
    kinds = (coverage.Covered("s", both, ("no",)), coverage.Covered("t", (alone,), ()))
    monkeypatch.setattr(coverage, "contact_coverage", lambda *_: kinds)
    assert coverage.main(["--contact", "3", "--flexures", "0", "--out", str(tmp_path)]) == 1
    page = (tmp_path / "coverage.md").read_text(encoding="utf-8")
    flags = "--contact 3 --flexures 0 --curved 0 --tilted 0 --squares 0 --direct 0.1 --tolerance 0.00025 --seed 1"
    assert f"coverage.py {flags}` writes this table" in page
    assert "| s | 2 | 1 | 1 | 50.0 % | 1.33 | 1.4 | 0.1 % | 0.1 % | 0.1 % |" in page
    assert "| t | 0 | 0 | 1 | - | - | - | - | - | - |" in page
