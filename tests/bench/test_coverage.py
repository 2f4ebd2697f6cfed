"""Ten random scenes of the coverage script, judged by the next finer mesh; and planted errors that it sees."""

import dataclasses
import importlib.util
import sys
import types
from pathlib import Path

import pytest
from skfem import ElementHex1

import solve.fruit.remainder
from cad.quantity import InputError
from mesh.housing.sweep import flexure_mesh
from pipeline.bench.hard import contact as hard_contact
from pipeline.bench.hard import flexure as hard_flexure
from solve.fruit.split import LARGEST_ERROR, LEVELS
from solve.housing.stiffness import tip_compliance

SCRIPT = Path(__file__).with_name("coverage.py")


@pytest.fixture(scope="module")
def coverage():
    spec = importlib.util.spec_from_file_location("error_bar_coverage", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    yield module
    del sys.modules[spec.name]


@pytest.fixture
def quick(monkeypatch):
    """Judge by about twice the dofs instead of four times, and the coarsest level only."""
    monkeypatch.setattr(hard_contact, "FINER", (dataclasses.replace(LEVELS[1], step=0.57),))
    monkeypatch.setattr(hard_contact, "FOUR_TIMES", 1.0)


@pytest.mark.usefixtures("quick")
def test_ten_random_scenes_lie_inside_their_bars(coverage):
    for found in coverage.contact_coverage(10, 3, 0.0, LARGEST_ERROR):
        assert len(found.claims) == 10
        assert found.holds
        zero = dataclasses.replace(found, claims=tuple(dataclasses.replace(one, bar=0.0) for one in found.claims))
        assert not zero.holds


@pytest.mark.usefixtures("quick")
def test_scenes_at_a_loose_tolerance_lie_inside_their_bars(coverage):
    for found in coverage.contact_coverage(5, 3, 0.0, 0.02):
        assert len(found.claims) == 5
        assert found.holds


@pytest.mark.usefixtures("quick", "wrong_traction")
def test_a_wrong_sign_in_a_traction_does_not_hold(coverage):
    for found in coverage.contact_coverage(3, 3, 0.0, LARGEST_ERROR):
        assert (len(found.claims), len(found.refused)) == (0, 3)
        assert not found.holds


@pytest.mark.usefixtures("quick")
def test_a_mesh_at_order_1_does_not_hold(coverage, monkeypatch):
    monkeypatch.setattr(solve.fruit.remainder, "ElementHex2", ElementHex1)
    assert not any(found.holds for found in coverage.contact_coverage(5, 3, 0.0, 0.02))


def test_refusals_count_where_an_answer_is_promised(coverage):
    claims = (coverage.Claim(name="s", value=1.0, bar=1e-3, reference=1.0005, uncertainty=0.0, by="formula"),)
    assert coverage.Covered("s", claims, ("no",)).holds
    assert not coverage.Covered("s", claims, ("no",), promised=True).holds
    assert not coverage.Covered("s", (), ("no",)).holds


@pytest.mark.parametrize(
    ("factor", "bar", "holds"), [(1.0, 0.2, True), (1.01, 0.2, False), (1.0, 0.0, False)],
    ids=["as it is", "spring 1 % off", "bar of zero"],
)  # fmt: skip
def test_flexures_take_turns_and_planted_errors_are_seen(factor, bar, holds, coverage, monkeypatch):
    """Judged and judging mesh are the same coarse one here, to be quick."""
    monkeypatch.setattr(hard_flexure, "FINER", 4.0)

    def judged(_rung, housing, E, poisson):
        K_l, K_h = tip_compliance(flexure_mesh(housing, 4.0), E, poisson).K
        stiffness = types.SimpleNamespace(K=(factor * K_l, K_h), error_percent=(bar, bar), dofs=1)
        return types.SimpleNamespace(stiffness=stiffness)

    monkeypatch.setattr(hard_flexure, "judge_on", judged)
    found = coverage.flexure_coverage(1, 1)
    assert [one.name for one in found] == ["flexure K_l, K_h, --tol 0.001", "flexure K_l, K_h, --tol 0.01"]
    assert [(len(one.claims), one.holds) for one in found] == [(2, holds), (2, holds)]


def test_every_process_that_can_be_made_takes_its_turn(coverage, monkeypatch):
    asked = []

    def guess(design):
        asked.append(design.print.process)
        if len(asked) == 1:
            msg = "must be refused once; the same process is drawn again"
            raise InputError(msg)
        return None, None

    monkeypatch.setattr(coverage, "beam_guess", guess)
    claim = coverage.Claim(name="K", value=1.0, bar=1e-3, reference=1.0005, uncertainty=0.0, by="formula")
    monkeypatch.setattr(coverage, "stiffness_claims", lambda *_: (claim,) * 4)
    found = coverage.flexure_coverage(6, 1)
    assert asked == ["fdm-petg", "fdm-petg", "fdm-pla", "sls-pa12", "sla-resin", "dmls-17-4ph", "dmls-ti64"]
    assert [(len(one.claims), len(one.refused)) for one in found] == [(12, 1), (12, 1)]


def test_table_has_a_row_for_each_number(coverage):
    claim = coverage.Claim(name="s", value=1.0, bar=1e-3, reference=1.0005, uncertainty=0.0, by="formula")
    lines = list(coverage.table([coverage.Covered("s", (claim, dataclasses.replace(claim, reference=1.004)), ("no",))]))
    assert lines[2] == "| s | 2 | 1 | 50.0 % | 4.00 | 1.1 | 0.1 % | 0.1 % |"
