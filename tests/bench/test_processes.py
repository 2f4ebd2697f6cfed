"""The page of processes: its columns by formulas, and a spring, a peer or tetrahedra that disagree are seen."""

import itertools
import types
from pathlib import Path

import pytest
from scripts import loaded_script

from cad.design.parameters import Design, Print
from cad.design.processes import PROCESSES
from cad.quantity import InputError
from cad.theory.leaf_spring import pair_stiffness
from pipeline.bench.flexure import HOUSING

SCRIPT = Path(__file__).with_name("processes.py")
TARGETS = (0.9, 20.0)
HELD = 1.01  # what the frame is stiffer by where its holes are clamped and not its rim held between covers


@pytest.fixture
def processes():
    return loaded_script(SCRIPT)


@pytest.fixture
def planted(processes, monkeypatch, tmp_path):
    """Return a run with planted relative errors of the low spring: ours to its target, CalculiX and tetrahedra to ours.

    CPU seconds are planted too: a fit costs 6, a mesh 1, a solve 2.
    """

    def guess(design):
        if design.print.process == "dmls-ti64":
            msg = "too short, must be a leaf"
            raise InputError(msg)
        return HOUSING, TARGETS

    def run(low, peer, tets, fit=6.0):
        K = (TARGETS[0] * (1.0 + low), TARGETS[1])
        fitted = types.SimpleNamespace(stiffness=types.SimpleNamespace(K=K, error=(4e-4, 6e-4)), housing=HOUSING)
        by_its_holes = types.SimpleNamespace(K=tuple(HELD * value for value in K))
        costs = itertools.cycle([(fitted, fit), (None, 1.0), (by_its_holes, 2.0)])
        reference = types.SimpleNamespace(K=(HELD * K[0] * (1.0 + tets), HELD * K[1]), spread_percent=(0.1, 0.2))
        monkeypatch.setattr(processes, "timed", lambda _: next(costs))
        peer_K = HELD * K[0] * (1.0 + peer), HELD * K[1]
        monkeypatch.setattr(processes, "peer_stiffness", lambda *_: (peer_K, 1.0, 300))
        monkeypatch.setattr(processes, "checked", lambda *_: reference)
        code = processes.main(["--tets", "--out", str(tmp_path)])
        return code, (tmp_path / "process-springs.md").read_text(encoding="utf-8").splitlines()

    monkeypatch.setattr(processes, "beam_guess", guess)
    monkeypatch.setattr(processes, "is_installed", lambda: True)
    return run


def test_each_process_has_two_rows_and_one_that_is_refused_says_why(planted):
    code, lines = planted(5e-4, -2e-5, 1e-3)
    assert code == 0
    rows = [line for line in lines if " low | " in line or " high | " in line]
    assert len(rows) == 2 * (len(PROCESSES) - 1)
    words = "fdm-petg low | 900 | 24.200 | 900.45 | +0.05 % | 0.04 % | -0.002 % | +0.1 %, 0.1 % | 6 | 2"
    assert rows[0] == f"| {words} |"
    assert "- dmls-ti64: too short, must be a leaf" in lines
    assert any(line.startswith("`tests/bench/processes.py --tets` writes this table") for line in lines)


@pytest.mark.parametrize("wrong", [(2e-3, 0.0, 0.0), (0.0, 2e-4, 0.0), (0.0, 0.0, 4e-3), (0.0, 0.0, 0.0, 19.0)])
def test_planted_disagreement_or_a_dear_fit_fails(wrong, planted):
    assert planted(*wrong)[0] == 1


def test_beam_guess_has_the_lengths_of_the_beam_law_or_the_reason_why_not(processes):
    housing, targets = processes.beam_guess(Design())
    for arm, K in zip(housing.arms, targets, strict=True):
        leaf = arm.flexure
        assert pair_stiffness(2000.0, leaf.depth, leaf.thickness, leaf.length) == pytest.approx(K, rel=1e-9)
    with pytest.raises(InputError, match=r"print\.max_length_mm"):
        processes.beam_guess(Design(print=Print(max_length_mm=5.0)))
