"""The bench: its parts against formulas, peers that lie are refused, and one quick run from end to end."""

import itertools
import json
import shutil
import stat
import sys
import types
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from cad.design.parameters import Design, Fruit, Print, Tips
from cad.parts.fruit import fruit_quarter
from cad.quantity import InputError
from cad.theory.leaf_spring import pair_stiffness
from mesh.fruit import fruit_mesh
from mesh.housing.sweep import flexure_mesh
from pipeline.bench import bench as bench_module
from pipeline.bench import calculix as peers
from pipeline.bench import command as bench_command
from pipeline.bench import contact as bench_contact
from pipeline.bench import flexure as bench_flexure
from pipeline.bench.bench import bench, contact_sheets, exponent
from pipeline.bench.calculix import LinearStep, calculix, hexahedra, node_set, tetrahedra
from pipeline.bench.command import command_costs
from pipeline.bench.hard.reference_check import DeclinedError
from pipeline.bench.plot import Curve, Panel, svg
from pipeline.bench.resources import Cost, cost_of, module_cost
from pipeline.bench.table import Measured, percent, work_sheet, write_whole
from solve.fruit.direct import mesh_compliance
from solve.housing.element_study import CHOICES, boundary_places, compared_stiffness, straightened
from solve.housing.stiffness import tip_compliance
from solve.linear import SolveError

FRUIT, TIPS = Fruit(), Tips()
needs_ccx = pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")
SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(scope="module")
def housing_mesh():
    return flexure_mesh(bench_flexure.HOUSING, 4.0)


def measured(**changed):
    whole = {"method": "split", "mesh": "m", "cpu": 0.1, "error": 1e-4, "second": -2e-4, "dofs": 300, "estimated": 3e-4}
    return Measured(**{**whole, **changed})


def test_exponent_is_the_slope_of_a_power():
    x = [1.0, 3.0, 10.0]
    assert exponent(x, [2.0 * value**-1.5 for value in x]) == pytest.approx(-1.5, abs=1e-12)


def test_curve_puts_a_decade_where_its_logarithm_is():
    curve = Curve(name="a < b", points=((1.0, 1e-4), (10.0, 1e-2), (100.0, 0.0)))
    drawn = ET.fromstring(svg([Panel(title="t", x_label="x", y_label="y", curves=(curve,))]))
    (line,) = drawn.iter(f"{SVG}polyline")
    (x0, y0), (x1, y1) = (map(float, point.split(",")) for point in line.get("points").split())
    assert (x0, y0, x1, y1) == (0.0, 300.0, 380.0, 0.0)
    assert "a < b" in [text.text for text in drawn.iter(f"{SVG}text")]


def test_curve_without_a_point_is_refused():
    with pytest.raises(ValueError, match="must have at least one point above 0"):
        svg([Panel(title="t", x_label="x", y_label="y", curves=(Curve(name="c", points=((1.0, 0.0),)),))])


def test_table_says_the_same_in_markdown_and_for_machines():
    sheet = work_sheet("contact", "title", ("s11 - s12", "s11"), [measured()], ["note"])
    assert "| split | m | 300 | 0.1 | +0.01 % | -0.02 % | 0.03 % |  |" in sheet.markdown()
    assert sheet.records[0]["error"] == 1e-4
    assert (percent(-0.05), percent(None)) == ("-5 %", "-")


def test_peer_is_compared_at_the_goal_or_where_it_ends():
    def notes(ours):
        rows = [vars(ours), vars(measured(method="CalculiX C3D10", error=1e-2, cpu=5.0))]
        return " ".join(contact_sheets({"rows": rows, "scenes": {}, "refused": ["CalculiX: stopped"]})[0].notes)

    known = notes(measured(second=0.0, estimated=1e-4))
    assert "no peer within 0.01 %; nearest: CalculiX C3D10 at 1 %, 5 CPU s, 50 times as much" in known
    assert "CalculiX: stopped" in known
    by_luck = notes(measured(second=0.0, estimated=3e-4))
    assert "times as much" not in by_luck


def test_files_appear_whole_or_are_refused(tmp_path):
    write_whole(tmp_path / "a" / "b", {"x.md": "text\n"})
    assert [path.name for path in (tmp_path / "a" / "b").iterdir()] == ["x.md"]
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(InputError, match=r"--out = .*: must be a folder that can be written"):
        write_whole(tmp_path / "file", {"x.md": "text\n"})


def test_cost_of_a_program_is_its_own():
    large = cost_of(
        [sys.executable, "-c", "x = bytearray(300 << 20); x[::4096] = b'1' * len(x[::4096]); raise SystemExit(3)"]
    )
    small = cost_of([sys.executable, "-c", "import sys; print('out'); print('err', file=sys.stderr)"])
    assert (large.code, small.code, small.out, small.last_error) == (3, 0, "out\n", "err")
    assert large.peak_MiB > 300.0 > small.peak_MiB
    assert small.cpu > 0.0


def test_command_is_compared_with_its_imports(monkeypatch):
    calls = []

    def stand_in(command, folder=None, environment=None):
        calls.append((command, folder, environment))
        wall = 2.0 if command[-1] == bench_command.IMPORTS else 7.0
        return Cost(code=0 if wall == 2.0 else 2, wall=wall, cpu=1.0, peak_MiB=100.0, out="", err="pipeline: no\n")

    monkeypatch.setattr(bench_command, "cost_of", stand_in)
    bare, cold, *_ = command_costs(repeats=1)
    assert (bare.ratio, cold.ratio, cold.failure) == (1.0, 3.5, "exit code 2: pipeline: no")
    assert len({call[2]["XDG_CACHE_HOME"] for call in calls if call[2]}) == 1


def test_comparison_with_the_products_element_is_the_product(housing_mesh):
    """Two codes for the load of a face: by a linear form there, by quadrature of the basis here."""
    E, nu = bench_flexure.E_MPA, bench_flexure.POISSON
    product = tip_compliance(housing_mesh, E, nu)
    found = compared_stiffness(housing_mesh, "hex 20, reduced", E, nu)
    assert pytest.approx(product.K, rel=1e-7) == found.K
    assert compared_stiffness(straightened(housing_mesh), "hex 20, reduced", E, nu).K[0] > product.K[0]


def test_unknown_element_is_refused(housing_mesh):
    with pytest.raises(InputError, match="element = 'hex 9': must be one of hex 20, reduced"):
        compared_stiffness(housing_mesh, "hex 9", 1.0, 0.3)
    assert "tet P2" in CHOICES


def test_absent_peers_are_named(monkeypatch):
    monkeypatch.setattr(peers.shutil, "which", lambda _: None)
    monkeypatch.setattr(peers.importlib.util, "find_spec", lambda _: None)
    assert peers.absent() == ("CalculiX (ccx)", "ngsolve", "felupe", "sfepy")
    elements = tetrahedra(fruit_mesh(fruit_quarter(FRUIT, TIPS), FRUIT, TIPS, 4.0))
    with pytest.raises(SolveError, match="CalculiX = absent: the program ccx must be on the path"):
        calculix(elements, {}, (1.0, 0.3), [], "tips")


def contact_scene():
    mesh = fruit_mesh(fruit_quarter(FRUIT, TIPS), FRUIT, TIPS, 2.0)
    elements = tetrahedra(mesh)
    names = ("base", "symmetry_x", "symmetry_y", "high_tip")
    sets = {name: node_set(elements, boundary_places(mesh, "tet P2", name)) for name in names}
    held = {"base": (1, 2, 3), "symmetry_y": (2,), "symmetry_x": (1,)}
    return mesh, elements, sets, LinearStep(held=held, pressed={"high_tip": 1.0}, loads={})


@needs_ccx
def test_calculix_on_the_same_tetrahedra_agrees():
    mesh, elements, sets, step = contact_scene()
    found = calculix(elements, sets, (1.0, FRUIT.poisson), [step], "high_tip")
    S = mesh_compliance(mesh, FRUIT.poisson).S
    assert 0.5 / found.forces[0]["high_tip"] == pytest.approx(S[0, 0] + S[0, 1], rel=1e-6)
    assert set(found.displacements[0].values()) == {1.0}


@needs_ccx
@pytest.mark.parametrize(("kind", "choice"), [("C3D20R", "hex 20, reduced"), ("C3D20", "hex 20, full")])
def test_calculix_on_the_same_hexahedra_agrees(kind, choice, housing_mesh):
    (row,) = bench_flexure._calculix_row(hexahedra(housing_mesh, kind), housing_mesh, (choice, "coarse"), 0.0)
    own = compared_stiffness(housing_mesh, choice, bench_flexure.E_MPA, bench_flexure.POISSON)
    assert (row.error, row.second) == pytest.approx(bench_flexure.errors(own.K), abs=2e-6)


@pytest.mark.parametrize(
    ("printed", "table", "words"),
    [
        ("*ERROR in gen3delem", "", "ERROR in gen3delem"),
        ("divergence allowed", "", "job not finished"),
        ("Job finished", "", "0 tables of results for 1 steps"),
        ("Job finished", "FORCES", "0.5 N pressed, -0.4 N carried"),
    ],
)
def test_calculix_that_ends_with_exit_code_0_and_garbage_is_refused(printed, table, words, tmp_path, monkeypatch):
    _, elements, sets, step = contact_scene()
    dat = (
        " total force (fx,fy,fz) for set SUPPORT0 and time  1\n\n 0. 0. -0.4\n\n"
        " total force (fx,fy,fz) for set HIGH_TIP and time  1\n\n 0. 0. 0.5\n\n"
        " displacements (vx,vy,vz) for set HIGH_TIP and time  1\n\n 1 0. 0. 1.\n"
    )
    program = tmp_path / "ccx"
    body = f"cat > scene.dat <<'E'\n{dat}E\n" if table else ""
    program.write_text(f"#!/bin/sh\n{body}echo '{printed}'\n", encoding="utf-8")
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setattr(peers.shutil, "which", lambda _: str(program))
    with pytest.raises(SolveError, match=words):
        calculix(elements, sets, (1.0, 0.3), [step], "high_tip")


def test_closed_loop_is_weighed_against_one_mesh_and_solve(monkeypatch):
    """CPU seconds are planted: a fit costs 6, a mesh 1, a solve 2; the strip is declined."""
    stiffness = types.SimpleNamespace(K=(1.001, 20.0), error_percent=(0.04, 0.06))
    fitted = types.SimpleNamespace(stiffness=stiffness, housing=None, solves=(1, 2))
    costs = itertools.cycle([(fitted, 6.0), (None, 1.0), (None, 2.0)])

    def guess(design):
        if design.print.process == "strip-steel":
            raise DeclinedError
        return None, (1.0, 20.0)

    monkeypatch.setattr(bench_flexure, "beam_guess", guess)
    monkeypatch.setattr(bench_flexure, "timed", lambda _: next(costs))
    rows, dearest = bench_flexure.closed_loops()
    assert [row.mesh for row in rows] == ["fdm-petg", "fdm-pla", "sls-pa12", "sla-resin", "dmls-17-4ph", "dmls-ti64"]
    assert (rows[0].cpu, rows[0].error, rows[0].second) == pytest.approx((6.0, 1e-3, 0.0))
    assert rows[0].remark == "against targets; 2.0 x one mesh + solve"
    assert dearest == {"loop": 6.0, "once": 3.0, "fine": 1, "coarse": 2}


def test_beam_guess_has_the_lengths_of_the_beam_law_or_the_reason_why_not():
    housing, (K_low, K_high) = bench_flexure.beam_guess(Design())
    for flexure, K in ((housing.low, K_low), (housing.high, K_high)):
        assert pair_stiffness(2000.0, flexure.depth, flexure.thickness, flexure.length) == pytest.approx(K, rel=1e-9)
    with pytest.raises(DeclinedError, match="the strip is clamped in a body of another material"):
        bench_flexure.beam_guess(Design(print=Print(process="strip-steel")))


def test_missing_node_is_refused():
    elements = tetrahedra(fruit_mesh(fruit_quarter(FRUIT, TIPS), FRUIT, TIPS, 4.0))
    with pytest.raises(SolveError, match="a node is missing by"):
        node_set(elements, np.array([[0.1234], [0.1234], [-0.1234]]))


def test_module_runs_as_a_program_on_one_thread():
    assert module_cost("pipeline.bench.plot").code == 0
    assert module_cost("pipeline.no_such_module").code == 1


def test_measurement_that_ends_badly_is_refused(monkeypatch):
    failed = Cost(code=1, wall=1.0, cpu=1.0, peak_MiB=1.0, out="", err="Traceback\nKeyError: 'x'\n")
    monkeypatch.setattr(bench_module, "module_cost", lambda *_: failed)
    with pytest.raises(InputError, match=r"pipeline\.bench_contact = 'exit code 1': must be 0; it says: KeyError: 'x'"):
        bench(as_json=True, quick=True)


def test_quick_bench_from_end_to_end(tmp_path, capsys, monkeypatch):
    def in_this_process(module, *flags):
        measure = {"pipeline.bench.contact": bench_contact.measure, "pipeline.bench.flexure": bench_flexure.measure}
        out = json.dumps(measure[module]("--quick" in flags))
        return Cost(code=0, wall=1.0, cpu=1.0, peak_MiB=1.0, out=out, err="")

    monkeypatch.setattr(bench_module, "module_cost", in_this_process)
    assert bench(as_json=True, out=tmp_path, quick=True) == 0
    found = json.loads(capsys.readouterr().out)
    assert found == json.loads((tmp_path / "bench.json").read_text(encoding="utf-8"))
    rows = {(row["method"], row["mesh"]): row for row in found["contact"]["records"]}
    default = rows[("split", "step 0.7")]
    assert abs(default["error"]) < 1e-4
    assert abs(default["error"]) < default["estimated"]
    own = [row for row in found["flexure"]["records"] if row["method"].startswith("ours")]
    assert abs(own[1]["error"]) < min(abs(own[0]["error"]), own[1]["estimated"])
    assert "bench.svg" in (tmp_path / "bench.md").read_text(encoding="utf-8")
    assert ET.parse(tmp_path / "bench.svg").getroot().tag == f"{SVG}svg"
    assert bench_contact.REFERENCE["s11"] == 0.766603
