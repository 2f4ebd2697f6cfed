"""Peers in Python: a stand-in that answers well is heard, one that lies, crashes, hangs or is absent has no number.

The stand-in is an interpreter: a script that prints what the test says, whatever program it is given.
"""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from bench.peers import stiffness_solver
from scipy.sparse import diags_array

from pipeline.bench import contact, peers
from pipeline.bench.peers import FELUPE, NGSOLVE, PeerTask, absent_peers, deck_solvers, peer_answer
from pipeline.bench.resources import resource_usage
from pipeline.decks.deck import Deck, LinearStep
from pipeline.decks.elements import Elements
from solve.linear import SolveError

TASK = PeerTask(kind="deck", scene={"E": 1.0}, steps=[LinearStep(held={"base": (1, 2, 3)}, pressed={"high_tip": 1.0})])
GOOD = {"cpu": 1e-6, "dofs": 30, "steps": [{"forces": {"high_tip": 0.5, "support0": -0.5}, "displacements": [1.0]}]}


def changed(**values) -> str:
    return json.dumps({**GOOD, **values})


def with_forces(high, support) -> str:
    return changed(steps=[{"forces": {"high_tip": high, "support0": support}, "displacements": []}])


@pytest.fixture
def stand_in(tmp_path, monkeypatch):
    """Return a function that puts an interpreter in place whose scripts do what the lines say; it has each package."""

    def placed(lines: str) -> Path:
        program = tmp_path / "python"
        body = f"import sys\nif sys.argv[1] == '-c':\n    sys.exit(0)\n{lines}\n"
        program.write_text(f"#!{sys.executable}\n{body}", encoding="utf-8")
        program.chmod(0o755)
        monkeypatch.setattr(peers, "INTERPRETERS", (program,))
        peers._interpreter.cache_clear()
        return program

    yield placed
    peers._interpreter.cache_clear()


def test_peer_that_answers_well_is_heard(stand_in):
    stand_in(f"print('a line of its own')\nprint({changed()!r})")
    answer = peer_answer(FELUPE, TASK)
    assert (answer.results[0].forces["high_tip"], answer.dofs, answer.cpu) == (0.5, 30, 1e-6)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("", "not an answer, ''"),
        ("3.14", "not an answer, '3.14'"),
        ("{}", "not an answer"),
        (changed(steps=[1]), "not an answer"),
        (changed(steps=[]), "0 answers to 1 steps"),
        (changed(cpu=1e9), "1e[+]09 CPU s counted"),
        (changed(cpu=0.0), "0 CPU s counted"),
        (with_forces(float("nan"), -0.5), "nan"),
        (with_forces(0.5, -0.4), "0.5 N pressed, -0.4 N carried"),
        (with_forces(0.0, 0.0), "0 N pressed"),
        (changed(steps=[{"forces": {"support0": -0.5}, "displacements": []}]), "forces {'support0': -0.5}"),
    ],
)
def test_peer_that_answers_garbage_has_no_number(line, words, stand_in):
    stand_in(f"print({line!r})")
    with pytest.raises(SolveError, match=f"felupe: .*{words}"):
        peer_answer(FELUPE, TASK)


def test_peer_that_crashes_or_hangs_says_so_in_its_row(stand_in, monkeypatch):
    def solve():
        answer = peer_answer(NGSOLVE, TASK)
        return (1.0, 1.0), answer.cpu, answer.dofs

    stand_in("sys.exit('ImportError: no such package')")
    found = contact.BENCH.peer_row("NGSolve", "m", 0.5, solve)
    assert found.errors == ()
    assert "NGSolve: exit code 1, ImportError: no such package" in found.remark
    stand_in("import time\ntime.sleep(600)")
    assert NGSOLVE.interpreter is not None
    monkeypatch.setattr(peers, "DEADLINE", 0.5)
    found = contact.BENCH.peer_row("NGSolve", "m", 0.5, solve)
    assert found.errors == ()
    assert "NGSolve: still at work after 0.5 s" in found.remark


def test_peer_that_is_absent_is_named(stand_in, monkeypatch):
    stand_in("")
    monkeypatch.setattr(peers, "is_installed", lambda: True)
    assert absent_peers() == []
    assert list(deck_solvers("C3D20")) == ["CalculiX", "felupe", "GetFEM"]
    stand_in("").write_text(f"#!{sys.executable}\nraise SystemExit(1)\n", encoding="utf-8")
    monkeypatch.setattr(peers, "is_installed", lambda: False)
    assert absent_peers() == ["CalculiX (ccx)", "NGSolve", "felupe", "sfepy", "GetFEM"]
    assert deck_solvers("C3D10") == {}
    with pytest.raises(SolveError, match=r"felupe = absent: .* run make bench-peers"):
        peer_answer(FELUPE, TASK)


def test_peer_gets_the_whole_deck(stand_in):
    """The stand-in gives back u_z of what it read: the height of the nodes that the deck asks for."""
    line = (
        "import json, numpy as np\nfile = np.load(sys.argv[3])\nscene = json.loads(str(file['scene']))\n"
        "height = file['nodes'][file['set ' + scene['asked']], 2].tolist()\n"
        "press = scene['steps'][0]['pressed']['top']\n"
        "forces = {'top': press, 'support0': -press}\n"
        "print(json.dumps({'cpu': 1e-6, 'dofs': 3, 'steps': [{'forces': forces, 'displacements': height}]}))"
    )
    stand_in(line)
    nodes = np.random.default_rng(0).random((3, 10))
    elements = Elements(nodes=nodes, cells=np.arange(10)[None], kind="C3D10")
    step = LinearStep(held={"base": (1, 2, 3)}, pressed={"top": 2.0})
    sets = {"base": np.array([0, 1]), "top": np.array([4, 5, 6])}
    deck = Deck(elements=elements, sets=sets, E=1.0, poisson=0.3, steps=[step], asked="top")
    (result,), _ = deck_solvers("C3D10")["sfepy"](deck)
    assert result.forces == {"top": 2.0, "support0": -2.0}
    assert result.displacements[4:7] == pytest.approx(nodes[2, 4:7])
    assert np.count_nonzero(result.displacements) == 3


def test_program_beyond_its_deadline_is_killed():
    usage = resource_usage([sys.executable, "-c", "import time; time.sleep(600)"], deadline=0.3)
    assert usage.exit_code == -9
    assert usage.wall >= 0.3


def test_peers_interpreter_is_that_of_this_project_wherever_it_is_called(tmp_path, monkeypatch):
    """A stranger's interpreter in the folder where a user stands is never started."""
    started = tmp_path / "started"
    stranger = tmp_path / ".venv-peers" / "bin" / "python"
    stranger.parent.mkdir(parents=True)
    stranger.write_text(f"#!/bin/sh\ntouch '{started}'\n", encoding="utf-8")
    stranger.chmod(0o755)
    monkeypatch.chdir(tmp_path)
    peers._interpreter.cache_clear()
    absent_peers()
    peers._interpreter.cache_clear()
    assert not started.exists()
    assert all(interpreter.is_absolute() for interpreter in peers.INTERPRETERS)


def test_peers_without_a_solver_factorise_once_for_steps_with_the_same_free_dofs(monkeypatch):
    """A chain of springs of 1 N/mm, held at one end, moved or loaded at the other: its displacements are linear."""
    factorised, number = [], 6
    splu = stiffness_solver.splu
    monkeypatch.setattr(stiffness_solver, "splu", lambda *given, **how: factorised.append(how) or splu(*given, **how))
    diagonal = np.array([1.0, *[2.0] * (number - 2), 1.0])
    solver = stiffness_solver.StiffnessSolver(
        diags_array([diagonal, -np.ones(number - 1), -np.ones(number - 1)], offsets=[0, 1, -1]).tocsr()
    )
    ends, places = np.array([0, number - 1]), np.arange(float(number))
    for moved in (5.0, -10.0):
        found = solver.displacements(ends, np.array([0.0, moved]), np.zeros(number))
        np.testing.assert_allclose(found, moved / 5.0 * places, rtol=1e-12)
    assert factorised == [{"permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}]
    found = solver.displacements(ends[:1], np.zeros(1), np.array([*[0.0] * (number - 1), 2.0]))
    np.testing.assert_allclose(found, 2.0 * places, rtol=1e-12)
    assert len(factorised) == 2


@pytest.mark.parametrize("lacks", ["sfepy", "nothing"])
def test_set_up_of_the_peers_ends_well_only_when_all_are_there(lacks, tmp_path):
    """GetFEM is looked for in Debian's interpreter; the stand-in for apt-get installs nothing."""
    script = Path(peers.__file__).parents[2] / ".ci" / "peers"
    (tmp_path / "requirements-peers.lock").write_text("felupe==1\nsfepy==1\n", encoding="utf-8")
    (tmp_path / ".ci").mkdir()
    copy = shutil.copy(script, tmp_path / ".ci")
    programs = {".venv-peers/bin/python": f'cat > /dev/null; [ "$2" != "import {lacks}" ]', "bin/apt-get": "exit 1"}
    for name, line in programs.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"#!/bin/sh\n{line}\n", encoding="utf-8")
        path.chmod(0o755)
    places = {**os.environ, "PATH": f"{tmp_path / 'bin'}:{os.environ['PATH']}"}
    ended = subprocess.run(
        ["bash", copy], env=places, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=300, check=False
    )
    said = ended.stdout
    assert "peers: felupe is installed" in said
    assert ("peers: sfepy is not installed" in said) == (lacks == "sfepy")
    assert ended.returncode == ("is not installed" in said)
