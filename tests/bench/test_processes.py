"""The table of processes: its columns by formulas, and a spring, a peer or tetrahedra that disagree are seen."""

import importlib.util
import sys
import types
from pathlib import Path

import pytest

from cad.design.processes import PROCESSES
from pipeline.bench.flexure import HOUSING
from pipeline.bench.hard.reference_check import DeclinedError

SCRIPT = Path(__file__).with_name("processes.py")
TARGETS = (0.9, 20.0)


@pytest.fixture
def processes(monkeypatch):
    spec = importlib.util.spec_from_file_location("processes_table", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, spec.name, module)
    spec.loader.exec_module(module)

    def guess(design):
        if not PROCESSES[design.print.process].one_piece:
            msg = "clamped, must be one piece"
            raise DeclinedError(msg)
        return HOUSING, TARGETS

    monkeypatch.setattr(module, "beam_guess", guess)
    monkeypatch.setattr(module, "flexure_mesh", lambda _: None)
    monkeypatch.setattr(module, "hexahedra", lambda *_: None)
    monkeypatch.setattr(module, "absent", lambda: ())
    return module


def found(module, monkeypatch, low, peer, tets):
    """Plant relative errors of the low spring: ours to its target, CalculiX to ours, tetrahedra to ours."""
    K = (TARGETS[0] * (1.0 + low), TARGETS[1])
    stiffness = types.SimpleNamespace(K=K, error_percent=(0.04, 0.06))
    fitted = types.SimpleNamespace(stiffness=stiffness, housing=HOUSING)
    monkeypatch.setattr(module, "fit_flexures", lambda *_: fitted)
    monkeypatch.setattr(module, "calculix_stiffness", lambda *_: ((K[0] * (1.0 + peer), K[1]), 1.0))
    check = types.SimpleNamespace(K=(K[0] * (1.0 + tets), K[1]), spread_percent=(0.1, 0.2))
    monkeypatch.setattr(module, "checked", lambda *_: check)
    return module.main(["--tets", "2", "1.5"])


def test_each_process_has_two_lines_and_a_clamped_one_says_why_not(processes, monkeypatch, capsys):
    assert found(processes, monkeypatch, 5e-4, -2e-5, 1e-3) == 0
    told = capsys.readouterr()
    lines = told.out.splitlines()[2:]
    assert len(lines) == 2 * sum(process.one_piece for process in PROCESSES.values())
    assert lines[0] == ("| fdm-petg low | 900 | 24.200 | 900.45 | +0.05 % | 0.04 % | -0.002 % | +0.1 %, 0.1 % |")
    assert told.err == "strip-steel: clamped, must be one piece\n"


@pytest.mark.parametrize("planted", [(2e-3, 0.0, 0.0), (0.0, 2e-4, 0.0), (0.0, 0.0, 4e-3)])
def test_planted_disagreement_fails(planted, processes, monkeypatch):
    assert found(processes, monkeypatch, *planted) == 1
