"""The bench: its parts against formulas, a peer that lies is refused, and one quick run from end to end."""

import dataclasses
import itertools
import json
import shutil
import stat
import subprocess
import sys
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from cad.design.fruit import Fruit
from cad.design.tips import Tips
from cad.parts.fruit import fruit_quarter
from cad.quantity import InputError
from mesh.fruit import fruit_mesh
from mesh.housing.sweep import flexure_mesh
from pipeline.bench import bench as bench_module
from pipeline.bench import calculix as peer
from pipeline.bench import contact, flexure, harness, unilateral
from pipeline.bench.bench import bench
from pipeline.bench.calculix import calculix
from pipeline.bench.command import runs, stages
from pipeline.bench.command.bare_work import BareWork, recorded_systems
from pipeline.bench.command.stages import ColdRun, stage_sheet
from pipeline.bench.harness import measurements_of
from pipeline.bench.plot import error_over_cost
from pipeline.bench.resources import ResourceUsage, resource_usage
from pipeline.bench.table import Measurement, percent, publish, work_sheet
from pipeline.decks.deck import Deck, LinearStep
from pipeline.decks.elements import boundary_sets, peer_elements
from solve.fruit.direct import mesh_compliance
from solve.housing.element_study import CHOICES, element_stiffness, straightened
from solve.housing.stiffness import tip_compliance
from solve.linear import SolveError

FRUIT, TIPS = Fruit(), Tips()
needs_ccx = pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")
SVG = "{http://www.w3.org/2000/svg}"
NAMES = ("base", "symmetry_x", "symmetry_y", "high_tip")


@pytest.fixture(scope="module")
def housing_mesh():
    return flexure_mesh(flexure.HOUSING, 4.0)


@pytest.fixture(scope="module")
def contact_scene():
    mesh = fruit_mesh(fruit_quarter(FRUIT, TIPS), FRUIT, TIPS, 2.0)
    elements = peer_elements(mesh, "tet P2", "C3D10")
    held = {"base": (1, 2, 3), "symmetry_y": (2,), "symmetry_x": (1,)}
    step = LinearStep(held=held, pressed={"high_tip": 1.0})
    sets = boundary_sets(elements, mesh, "tet P2", NAMES)
    return mesh, Deck(elements=elements, sets=sets, E=1.0, poisson=FRUIT.poisson, steps=[step], asked="high_tip")


def row(method="split", cpu=0.1, errors=(1e-4, -2e-4), **changed):
    return Measurement(method=method, mesh="m", cpu=cpu, errors=errors, dofs=300, **changed)


def test_growth_is_the_slope_of_a_power():
    rows = [dataclasses.replace(row(cpu=1e-6 * n**2), dofs=n, errors=(-2.0 * n**-1.5, 0.0)) for n in (10, 30, 100)]
    assert "split: error ~ dofs^-1.50, CPU ~ dofs^2.00" in contact.BENCH.sheet(rows).notes


def test_drawing_has_every_method_once_and_repeats_byte_for_byte():
    rows = [row("a < b"), row("a < b", cpu=1.0), row("refused", errors=()), row("exact", errors=(0.0,))]
    drawn = error_over_cost({"contact": rows, "flexures": [row("c")]})
    words = [text.text for text in ET.fromstring(drawn).iter(f"{SVG}text")]
    counts = {"a < b": 1, "c": 1, "refused": 0, "exact": 0, "contact": 1, "flexures": 1}
    assert {word: words.count(word) for word in counts} == counts
    assert error_over_cost({"contact": rows, "flexures": [row("c")]}) == drawn


def test_table_says_the_same_in_markdown_and_for_machines():
    refused = row("CalculiX", errors=(), remark="stopped | early")
    sheet = work_sheet("contact", "title", ("s11 - s12", "s11"), [row(error_bar=3e-4), refused], ["note"])
    assert "| split | m | 300 | 0.1 | +0.01 % | -0.02 % | 0.03 % |  |" in sheet.markdown()
    assert "| CalculiX | m | 300 | 0.1 | - | - | - | stopped \\| early |" in sheet.markdown()
    assert sheet.records[0]["errors"] == (1e-4, -2e-4)
    assert percent(0.05) == "5 %"


def test_winner_is_named_whoever_it_is():
    def notes(bar, *others):
        ours = row(contact.JUDGED_SPLIT, 0.1, errors=(1e-4, 0.0), error_bar=bar)
        return " ".join(contact.BENCH.sheet([ours, *others]).notes)

    cheap, exact = row("felupe P2 tets", 0.01, (5e-2,)), row("NGSolve, order 4", 20.0, (1e-5,))
    found = notes(1e-4, cheap, exact)
    ours = f"{contact.JUDGED_SPLIT} at 0.01 % in 0.1 CPU s"
    peer = "the cheapest peer: NGSolve, order 4 at 0.001 % in 20 CPU s, 2e+02 times as much"
    assert f"within 10 % wins felupe P2 tets at 5 % in 0.01 CPU s; the product: {ours}, 10 times as much" in found
    assert f"within 1 % wins {ours}; {peer}" in found
    assert f"within 0.01 % wins {ours}; the cheapest peer is not there" in notes(1e-4, cheap)
    for by_luck in (3e-4, None):
        found = notes(by_luck, exact)
        assert "within 0.01 % wins NGSolve, order 4 at 0.001 % in 20 CPU s; the product is not there" in found
        assert "within 0.01 %: nobody" in notes(by_luck, cheap)


def test_every_row_that_meets_the_error_can_win():
    """A cheaper row of our own without the product's checks, and a formula that takes no time."""
    ours = row(contact.JUDGED_SPLIT, 0.2, error_bar=3e-4)
    rough, guess = (
        row("rough split", 0.05, error_bar=3e-3),
        dataclasses.replace(row("beam, Euler", 0.0, (0.07,)), dofs=0),
    )
    peers = row("CalculiX P2 tets", 0.5, (4e-2,)), row("felupe P2 tets", 0.4, (4e-2,))
    found = " ".join(contact.BENCH.sheet([ours, *peers, rough, guess]).notes)
    own = f"the product: {contact.JUDGED_SPLIT} at 0.02 % in 0.2 CPU s"
    peer = "the cheapest peer: felupe P2 tets at 4 % in 0.4 CPU s"
    wins = f"wins rough split at 0.02 % in 0.05 CPU s; {own}, 4 times as much"
    assert f"within 10 % {wins}; {peer}, 8 times as much; without a mesh: beam, Euler at 7 %" in found
    assert f"within 1 % {wins}; the cheapest peer is not there" in found
    assert f"within 0.1 % wins {ours.cost}; the cheapest peer is not there" in found


@pytest.mark.parametrize(
    ("error", "words"), [(0.0010, None), (0.0029, "so it cannot tell"), (0.0080, "so the bar is missed")]
)
def test_error_outside_its_own_bar_is_said(error, words):
    """The bar is 0.12 %, the reference of the low tip known to 0.61 %."""
    notes = unilateral.BENCH.sheet([row(unilateral.OURS, errors=(error, 0.0), error_bar=0.0012)]).notes
    found = [note for note in notes if "outside its error bar" in note]
    assert len(found) == (words is not None)
    assert all(note.endswith(f"the reference is known to 0.61 %, {words}") for note in found)


def test_peer_that_refuses_says_why_in_its_row(monkeypatch):
    def refused():
        raise SolveError("CalculiX: stopped")

    found = contact.BENCH.peer_row("CalculiX C3D10", "m", 1.0, refused)
    assert (found.errors, found.remark) == ((), "CalculiX: stopped")
    monkeypatch.setattr(harness, "absent_peers", lambda: ["felupe", "sfepy"])
    assert "not installed, so not measured: felupe, sfepy" in contact.BENCH.sheet([row()]).notes


def test_files_appear_whole_or_are_refused(tmp_path, capsys):
    publish(tmp_path / "a" / "b", {"x.md": "# text\n", "x.json": "{}\n"}, as_json=True)
    assert sorted(path.name for path in (tmp_path / "a" / "b").iterdir()) == ["x.json", "x.md"]
    assert list(json.loads(capsys.readouterr().out)) == ["digest"]
    publish(tmp_path / "a" / "b", {"x.md": "# text\n", "x.json": "{}\n"}, as_json=False)
    assert "sha256" not in capsys.readouterr().out
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(InputError, match=r"--out = .*: must be a folder that can be written"):
        publish(tmp_path / "file", {"x.md": "text\n"}, as_json=False)


def test_usage_of_a_program_is_its_own():
    large = resource_usage(
        [sys.executable, "-c", "x = bytearray(300 << 20); x[::4096] = b'1' * len(x[::4096]); raise SystemExit(3)"]
    )
    small = resource_usage([sys.executable, "-c", "import sys; print('out'); print('err', file=sys.stderr)"])
    assert (large.exit_code, small.exit_code, small.out, small.last_line) == (3, 0, "out\n", "err")
    assert large.peak_MiB > 300.0 > small.peak_MiB
    assert small.cpu > 0.0
    with pytest.raises(OSError, match="program 'no-such-program': must start"):
        resource_usage(["no-such-program"])


def test_command_is_compared_with_its_imports(monkeypatch):
    calls = []

    def stand_in(program, folder=None, environment=None):
        calls.append((program, folder, environment))
        if program[-1] == runs.IMPORTS:
            return ResourceUsage(exit_code=0, wall=2.0, cpu=1.0, peak_MiB=100.0, out="", err="")
        if "design" in program[-1]:
            return ResourceUsage(exit_code=2, wall=7.0, cpu=4.0, peak_MiB=100.0, out="", err="pipeline: no\n")
        if folder is not None:
            (folder / "out").mkdir(exist_ok=True)
            report = {"cpu_seconds": {"contact": 0.5, "springs": 2.25, "verdicts": 0.001, "total": 3.0}}
            (folder / "out" / "report.json").write_text(json.dumps(report))
        return ResourceUsage(exit_code=1, wall=7.0, cpu=4.0, peak_MiB=100.0, out="", err="")

    monkeypatch.setattr(runs, "resource_usage", stand_in)
    monkeypatch.setattr(
        runs, "bare_works", lambda pictures, _: [BareWork(stage="springs", cpu=0.5, what=f"{pictures}")]
    )
    sheet, by_stage = runs.command_sheets(repeats=1)
    rows = {row[0]: row[1:] for row in sheet.rows}
    assert rows == {
        "bare imports": ("2", "1", "1", "-", "1", "-", "100", ""),
        "our imports": ("7", "4", "3.5", "-", "4", "-", "100", ""),
        "those of the modeller": ("7", "4", "3.5", "-", "4", "-", "100", ""),
        "cold": ("7", "4", "3.5", "1.8", "4", "2.4", "100", "total 3.00, springs 2.25, contact 0.50"),
        "unchanged": ("7", "4", "3.5", "0.3", "4", "0.3", "100", ""),
        "another --nl": ("7", "4", "3.5", "1.8", "4", "1.8", "100", "total 3.00, springs 2.25, contact 0.50"),
        "design, cold": ("7", "4", "3.5", "-", "4", "-", "100", "exit code 2: pipeline: no"),
    }
    assert sheet.notes[-1] == (
        "missed goals: cold: wall / imports 3.5 for 1.8; cold: CPU / imports 4 for 2.4; unchanged: wall / imports 3.5 "
        "for 0.3; unchanged: CPU / imports 4 for 0.3; another --nl: wall / imports 3.5 for 1.8; another --nl: "
        "CPU / imports 4 for 1.8"
    )
    assert by_stage.rows[0] == ("springs", "2.2", "0.5", "4.5", "0")
    caches = [call[2].get("XDG_CACHE_HOME") for call in calls if call[1] is not None]
    assert caches[0] == caches[1] == caches[2] != caches[3]


def test_stages_stand_beside_their_bare_work():
    """Imports 3, stages 2 + 1 of 3.5 s, all 10: 0.5 s lie between the stages and 3.5 s after them."""
    run = ColdRun(imports=3.0, stages={"springs": 2.0, "errors": 1.0, "total": 3.5}, whole=10.0)
    bare = [BareWork(stage=stage, cpu=0.5, what="bare") for stage in ("page", "springs", "imports")]
    assert sum(run.parts().values()) == run.whole
    assert stage_sheet(run, bare).rows == (
        ("page", "3.5", "0.5", "7", "bare"),
        ("imports", "3", "0.5", "6", "bare"),
        ("springs", "2", "0.5", "4", "bare"),
        ("others: errors, between the stages", "1.5", "-", "-", "-"),
        ("all", "10", "1.5", "6.7", "all of these one after the other"),
    )


def test_systems_are_recorded_where_they_are_factorised(contact_scene):
    mesh, _ = contact_scene
    with recorded_systems() as systems:
        solved = mesh_compliance(mesh, FRUIT.poisson)
    mesh_compliance(mesh, FRUIT.poisson)
    both_symmetries = [solved.dofs, solved.dofs]  # tips alike, tips against each other
    assert [factor.matrix.shape[0] for factor in systems] == both_symmetries


def test_bare_imports_are_of_libraries_that_a_run_imports():
    names = stages.LIBRARIES.removeprefix("import ").split(", ")
    program = (
        f"import sys, pipeline.run, pipeline.storage.modeller.tasks; print([name in sys.modules for name in {names}])"
    )
    found = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=120)
    assert found.stdout.strip() == str([True] * len(names))


def test_bare_work_that_ends_badly_is_refused(monkeypatch):
    ended = ResourceUsage(exit_code=1, wall=1.0, cpu=1.0, peak_MiB=9.0, out="", err="No module named OCP")
    monkeypatch.setattr(stages, "resource_usage", lambda *_, **__: ended)
    with pytest.raises(InputError, match=r"bare_work = 'exit code 1': must be 0; it says: No module named OCP"):
        stages.bare_works(9, "here")


def test_met_goals_are_said_to_be():
    record = {"run": "cold", "wall / imports": 1.7, "goal": 1.8, "CPU / imports": 2.0, "CPU goal": 2.4, "peak MiB": 9.0}
    assert runs.goals_note([record]) == "missed goals: none"
    assert runs.goals_note([{**record, "peak MiB": 3e3}]) == "missed goals: cold: peak MiB 3e+03 for 2048"


def test_comparison_with_the_products_element_is_the_product(housing_mesh):
    """Two codes for the load of a face: by a linear form there, by quadrature of the basis here."""
    E, nu = flexure.E_MPA, flexure.POISSON
    product = tip_compliance(housing_mesh, E, nu)
    found = element_stiffness(housing_mesh, "hex 20, reduced", E, nu)
    assert pytest.approx(product.K, rel=1e-7) == found.K
    assert element_stiffness(straightened(housing_mesh), "hex 20, reduced", E, nu).K[0] > product.K[0]


def test_unknown_element_is_refused(housing_mesh):
    with pytest.raises(InputError, match="element = 'hex 9': must be one of hex 20, reduced"):
        element_stiffness(housing_mesh, "hex 9", 1.0, 0.3)
    assert "tet P2" in CHOICES


def test_beams_are_the_guided_beam_and_shear_of_a_rectangle():
    """K = 2 * 12 E I / L^3 of two leaves; shear gives L / (5/6 G A) more to each."""
    leaf, E, G = flexure.HOUSING.low, flexure.E_MPA, 0.5 * flexure.E_MPA / (1.0 + flexure.POISSON)
    area = leaf.depth * leaf.thickness
    bending = leaf.length**3 / (E * area * leaf.thickness**2)
    assert flexure.beam_stiffness(leaf, E, 0.0) == pytest.approx(2.0 / bending, rel=1e-12)
    shear = leaf.length / (5.0 / 6.0 * G * area)
    assert flexure.beam_stiffness(leaf, E, 1.0) == pytest.approx(2.0 / (bending + shear), rel=1e-12)


@needs_ccx
def test_calculix_on_the_same_tetrahedra_agrees(contact_scene):
    mesh, deck = contact_scene
    (found,), cpu = calculix(deck)
    S = mesh_compliance(mesh, FRUIT.poisson).S
    assert 0.5 / found.forces["high_tip"] == pytest.approx(S[0, 0] + S[0, 1], rel=1e-6)
    assert set(found.displacements[deck.sets["high_tip"]]) == {1.0}
    assert cpu > 0.0


@needs_ccx
@pytest.mark.parametrize(("kind", "choice"), [("C3D20R", "hex 20, reduced"), ("C3D20", "hex 20, full")])
def test_calculix_on_the_same_hexahedra_agrees(kind, choice, housing_mesh):
    K, _, _ = flexure.peer_stiffness(housing_mesh, (choice, kind), (flexure.E_MPA, flexure.POISSON))
    own = element_stiffness(housing_mesh, choice, flexure.E_MPA, flexure.POISSON)
    assert pytest.approx(own.K, rel=2e-6) == K


@pytest.mark.parametrize(
    ("printed", "table", "words"),
    [
        ("*ERROR in gen3delem", "", "ERROR in gen3delem"),
        ("divergence allowed", "", "job not finished"),
        ("Job finished", "", "0 tables of results for 1 steps"),
        ("Job finished", "FORCES", "0.5 N pressed, -0.4 N carried"),
    ],
)
def test_calculix_that_ends_with_exit_code_0_and_garbage_is_refused(
    printed, table, words, contact_scene, tmp_path, monkeypatch
):
    _, deck = contact_scene
    dat = (
        " total force (fx,fy,fz) for set SUPPORT0 and time  1\n\n 0. 0. -0.4\n\n"
        " total force (fx,fy,fz) for set HIGH_TIP and time  1\n\n 0. 0. 0.5\n\n"
        " displacements (vx,vy,vz) for set HIGH_TIP and time  1\n\n 1 0. 0. 1.\n"
    )
    program = tmp_path / "ccx"
    body = f"cat > scene.dat <<'E'\n{dat}E\n" if table else ""
    program.write_text(f"#!/bin/sh\n{body}echo '{printed}'\n", encoding="utf-8")
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setattr(peer.shutil, "which", lambda _: str(program))
    with pytest.raises(SolveError, match=words):
        calculix(deck)
    monkeypatch.setattr(peer.shutil, "which", lambda _: None)
    with pytest.raises(SolveError, match="CalculiX = absent: the program ccx must be on the path"):
        calculix(deck)


def test_missing_node_is_refused(contact_scene):
    with pytest.raises(SolveError, match="a node is missing by"):
        contact_scene[1].elements.at(np.array([[0.1234], [0.1234], [-0.1234]]))


def test_measurement_that_ends_badly_is_refused():
    with pytest.raises(InputError, match=r"pipeline\.nowhere = 'exit code 1': must be 0; it says: .*No module named"):
        measurements_of("pipeline.nowhere", quick=True)


def test_quick_bench_from_end_to_end(tmp_path, capsys, monkeypatch):
    def in_this_process(module, *, quick):
        rows = {
            unilateral.__name__: (unilateral.product_rows(), 1),
            contact.__name__: (contact.split_rows(), 3),
            flexure.__name__: (flexure.product_rows(), 2),
        }
        return list(itertools.islice(*rows[module])) if quick else []

    monkeypatch.setattr(bench_module, "measurements_of", in_this_process)
    assert bench(as_json=True, out=tmp_path, quick=True) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed == json.loads((tmp_path / "bench.json").read_text(encoding="utf-8"))
    split = {(found["method"], found["mesh"]): found for found in printed["contact"]["records"]}
    default = split[(contact.JUDGED_SPLIT, "to 0.1 %")]
    assert max(map(abs, default["errors"])) < 1e-4
    assert abs(default["errors"][0]) < default["error_bar"]
    (pressed,) = printed["unilateral contact"]["records"]
    assert abs(pressed["errors"][0]) < pressed["error_bar"] + 0.01  # of the reference
    coarse, fine = printed["flexures"]["records"]
    assert abs(fine["errors"][0]) < min(abs(coarse["errors"][0]), fine["error_bar"])
    text = (tmp_path / "benchmarks.md").read_text(encoding="utf-8")
    assert text.startswith("# Speed against error\n")
    assert "(benchmarks.svg)" in text
    assert ET.parse(tmp_path / "benchmarks.svg").getroot().tag == f"{SVG}svg"
