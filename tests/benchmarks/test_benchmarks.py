"""The benchmarks: the product's rows inside their bars, peers on the same mesh agree, a peer that lies is refused."""

import json
import os
import shutil
import stat
import subprocess
import sys
from pathlib import Path

import pytest
from bars import bars, holds
from deadline import DEADLINE_S

from benchmarks import calculix as calculix_module
from benchmarks import flexure, peers
from benchmarks.calculix import calculix
from benchmarks.deck import TETRAHEDRA
from benchmarks.peers import FELUPE, PeerTask, peer_answer
from mesh.housing.sweep import flexure_mesh
from pipeline.storage.deck import Deck, LinearStep, boundary_sets, elements_of
from reference.direct_fruit import mesh_compliance
from reference.element_study import element_basis, element_stiffness
from reference.fruit_meshes import fruit_mesh, solved_block
from sensor.design.fruit import Fruit
from sensor.design.tips import Tips
from sensor.quantity import InputError
from solve.housing.stiffness import tip_compliance
from solve.linear import SolveError

ROOT = Path(__file__).parents[2]
ALONE = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
FRUIT, TIPS = Fruit(), Tips()
needs_ccx = pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")


@pytest.fixture(scope="module")
def housing_mesh():
    return flexure_mesh(flexure.HOUSING, 4.0)


@pytest.fixture(scope="module")
def contact_scene():
    mesh = fruit_mesh(solved_block(FRUIT, TIPS), FRUIT, TIPS, 2.0)
    basis = element_basis(mesh, TETRAHEDRA[0])
    elements = elements_of(basis, TETRAHEDRA[1])
    step = LinearStep(held={"base": (1, 2, 3), "symmetry_y": (2,), "symmetry_x": (1,)}, pressed={"high_tip": 1.0})
    sets = boundary_sets(elements, basis, ("base", "symmetry_x", "symmetry_y", "high_tip"))
    return mesh, Deck(elements=elements, sets=sets, E=1.0, poisson=FRUIT.poisson, steps=[step], printed_set="high_tip")


@pytest.mark.parametrize("name", bars("bench"))
def test_error_bar_of_the_products_rows_holds(name):
    holds(name)


def test_comparison_with_the_products_element_is_the_product(housing_mesh):
    """Two codes for the load of a face: by a linear form there, by quadrature of the basis here."""
    material = (flexure.E_MPA, flexure.POISSON)
    solved = element_stiffness(housing_mesh, "hex 20, reduced", *material)
    assert pytest.approx(tip_compliance(housing_mesh, *material).K, rel=1e-7) == solved.K
    with pytest.raises(InputError) as refused:
        element_stiffness(housing_mesh, "hex 9", *material)
    assert refused.value.field == "element"


@pytest.mark.slow
@needs_ccx
def test_calculix_on_the_same_meshes_agrees(contact_scene, housing_mesh):
    """CalculiX prints seven digits."""
    mesh, deck = contact_scene
    (found,), _ = calculix(deck)
    S = mesh_compliance(mesh, FRUIT.poisson).S
    assert 0.5 / found.forces["high_tip"] == pytest.approx(S[0, 0] + S[0, 1], rel=1e-6)
    material = (flexure.E_MPA, flexure.POISSON)
    for kind, choice in (("C3D20R", "hex 20, reduced"), ("C3D20", "hex 20, full")):
        K = flexure.peer_stiffness(housing_mesh, (choice, kind), material).values
        assert pytest.approx(element_stiffness(housing_mesh, choice, *material).K, rel=2e-6) == K


@pytest.mark.parametrize(
    ("printed", "has_table"),
    [("*ERROR in gen3delem", False), ("divergence allowed", False), ("Job finished", False), ("Job finished", True)],
)
def test_calculix_that_ends_with_exit_code_0_and_garbage_is_refused(
    printed, has_table, contact_scene, tmp_path, monkeypatch
):
    """The last table has 0.5 N pressed and 0.4 N carried."""
    dat = (
        " total force (fx,fy,fz) for set SUPPORT0 and time  1\n\n 0. 0. -0.4\n\n"
        " total force (fx,fy,fz) for set HIGH_TIP and time  1\n\n 0. 0. 0.5\n\n"
        " displacements (vx,vy,vz) for set HIGH_TIP and time  1\n\n 1 0. 0. 1.\n"
    )
    program = tmp_path / "ccx"
    body = f"cat > scene.dat <<'E'\n{dat}E\n" if has_table else ""
    program.write_text(f"#!/bin/sh\n{body}echo '{printed}'\n", encoding="utf-8")
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setattr(calculix_module.shutil, "which", lambda _: str(program))
    with pytest.raises(SolveError):
        calculix(contact_scene[1])


GOOD = {"forces": {"tip": 1.0, "support0": -1.0}, "displacements": []}


def peer_says(answer, folder, monkeypatch):
    """Return what the reader of peers makes of a program that prints an answer, or crashes without one."""
    program = f"import time\nwhile time.process_time() < 2e-3: pass\nprint({json.dumps(answer)!r})"
    (folder / "with_felupe.py").write_text("raise SystemExit(3)" if answer is None else program, encoding="utf-8")
    monkeypatch.setattr(peers, "SCRIPTS", folder)
    monkeypatch.setattr(peers, "_interpreter", lambda *_: sys.executable)
    task = PeerTask(kind="deck", scene={}, steps=[LinearStep(held={}, pressed={"tip": 1.0})])
    return peer_answer(FELUPE, task)


@pytest.mark.parametrize(
    "answer",
    [
        {"cpu": 1e-4, "dofs": 3, "steps": []},
        {"cpu": 1e-4, "dofs": 3, "steps": [{**GOOD, "forces": {"tip": 1.0, "support0": -0.9}}]},
        {"cpu": 1e-4, "dofs": 3, "steps": [{**GOOD, "forces": {"tip": 1.0}}]},
        {"cpu": 1e9, "dofs": 3, "steps": [GOOD]},
        "nonsense",
        None,
    ],
)
def test_a_peer_that_lies_or_crashes_has_no_number(answer, tmp_path, monkeypatch):
    with pytest.raises(SolveError):
        peer_says(answer, tmp_path, monkeypatch)


def test_a_peer_that_answers_well_is_heard(tmp_path, monkeypatch):
    answer = peer_says({"cpu": 1e-4, "dofs": 3, "steps": [GOOD]}, tmp_path, monkeypatch)
    assert (answer.dofs, answer.results[0].forces) == (3, GOOD["forces"])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["cheeks", "one_press"])
def test_benchmark_that_takes_units_of_the_tests_starts_as_the_pages_say(name):
    """From the root of the project, where no test has put its own folder on the path."""
    command = [sys.executable, "-m", f"benchmarks.{name}", "--help"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, check=False, timeout=DEADLINE_S, env=ALONE)
    assert done.returncode == 0
