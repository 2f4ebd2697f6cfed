"""`pipeline read` from the command line: forces, files, streams, firmware, and its exit codes."""

import io
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from stand_ins import CONTACT, result_of

from cad.design.fruit import Fruit
from cad.design.parameters import Design
from cad.design.tips import Press
from pipeline.cli import main
from pipeline.report.outputs import write_outputs

ROOT = Path(__file__).parents[4]
KEYS = {"E_MPa", "E_over_1_minus_nu2_MPa", "u_percent", "tilt_deg", "flags", "class"}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Return the folder of a paper sensor whose contact and springs stand in for solved ones, and its result."""
    folder = tmp_path_factory.mktemp("read") / "paper"
    folder.mkdir()
    result = result_of()
    write_outputs(result, folder)
    return folder, result


def forces_at(result, E, travel=0.6):
    return np.linalg.solve(result.springs.C + CONTACT.S / E, [travel, travel])


def press_csv(result, E):
    rows = [forces_at(result, E, x) for x in np.linspace(0.02, 0.6, 30)]
    lines = "".join(f"{0.001 * place},{soft},{stiff}\n" for place, (soft, stiff) in enumerate(rows))
    return "t_s,F_l_N,F_h_N\n" + lines


def test_forces_of_a_pair(made, capsys):
    folder, result = made
    forces = ",".join(map(str, forces_at(result, 1.5)))
    assert main(["read", str(folder), "--forces", forces, "--json", "--classes", "ripe:0.8,unripe"]) == 0
    answer = capsys.readouterr()
    reading = json.loads(answer.out)
    assert reading.keys() >= KEYS
    assert reading["E_MPa"] == pytest.approx(1.5, rel=1e-6)
    assert (reading["class"], reading["flags"]) == ("unripe", ["uncertain"])  # springs as the process scatters them
    assert reading["u_percent"] > 50.0
    assert "force ratio" in answer.err
    assert "no --unit" in answer.err


def test_flags_may_stand_before_the_file(made, capsys, tmp_path):
    folder, result = made
    path = tmp_path / "press.csv"
    path.write_text(press_csv(result, 2.0), encoding="utf-8")
    assert main(["read", str(folder), "--json", str(path)]) == 0
    assert json.loads(capsys.readouterr().out)["E_MPa"] == pytest.approx(2.0, rel=1e-6)


def test_file_and_stream_read_alike(made, capsys, tmp_path, monkeypatch):
    folder, result = made
    text = press_csv(result, 2.5)
    path = tmp_path / "press.csv"
    path.write_text(text, encoding="utf-8")
    assert main(["read", str(folder), str(path), "--json"]) == 0
    from_file = capsys.readouterr().out
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(text.encode())))
    assert main(["read", str(folder), "-", "--json"]) == 0
    assert capsys.readouterr().out == from_file
    (line,) = from_file.splitlines()
    assert json.loads(line)["E_MPa"] == pytest.approx(2.5, rel=1e-6)
    assert main(["read", str(folder), str(path), "--each"]) == 0
    assert len(capsys.readouterr().out.splitlines()) > 25


def test_calibrated_unit_is_taken_with_its_classes(made, capsys, tmp_path):
    folder, result = made
    K = 1.0 / np.diag(result.springs.C)
    lines = ["tip,weight_g,deflection_mm"]
    lines += [
        f"{name},{g},{g * 9.80665e-3 / K[i] / 1.2}" for i, name in enumerate(("low", "high")) for g in (0, 10, 30)
    ]
    table, unit = tmp_path / "weights.csv", tmp_path / "unit.toml"
    table.write_text("\n".join(lines), encoding="utf-8")
    assert main(["calibrate", str(folder), str(table), "--out", str(unit), "--classes", "ripe:0.8,unripe"]) == 1
    answer = capsys.readouterr().out
    assert "+20.0 % against the design's" in answer
    assert "is off by -16.7 % at worst" in answer
    assert main(["calibrate", str(folder), str(table), "--json"]) == 1
    first = json.loads(capsys.readouterr().out)["table"][0]
    assert first["with_design_stiffness_percent"] == pytest.approx(-16.7, abs=0.1)
    forces = np.linalg.solve(result.springs.C / 1.2 + CONTACT.S / 1.5, [0.6, 0.6])
    words = ["read", str(folder), "--unit", str(unit), "--forces", ",".join(map(str, forces)), "--json"]
    assert main(words) == 0
    reading = json.loads(capsys.readouterr().out)
    assert reading["E_MPa"] == pytest.approx(1.5, rel=1e-3)
    assert reading["class"] == "unripe"
    assert main(["calibrate", str(folder), str(table), "--out", str(unit)]) == 2
    assert "must be a file that is not there yet" in capsys.readouterr().err


def test_firmware_is_written_and_not_over_another_file(made, capsys, tmp_path):
    folder, _ = made
    header, module = tmp_path / "unit.h", tmp_path / "unit.py"
    words = ["read", str(folder), "--c-header", str(header), "--micropython", str(module)]
    assert main(words) == 0
    assert capsys.readouterr().out.split() == [str(header), str(module)]
    assert "twintip_end" in header.read_text(encoding="utf-8")
    header.write_text("mine", encoding="utf-8")
    assert main(words) == 2
    assert header.read_text(encoding="utf-8") == "mine"
    assert main([*words, "--force"]) == 0


@pytest.mark.parametrize(
    "words",
    [
        ["--micropython", "there.py"],
        ["--micropython", "new.h"],
        ["there.py", "--forces", "0.2,0.5"],
        ["nowhere.csv"],
        ["there.py"],
        ["--forces", "0.2,nan"],
    ],
)
def test_wrong_input_writes_nothing(made, tmp_path, monkeypatch, words):
    folder, _ = made
    monkeypatch.chdir(tmp_path)
    Path("there.py").write_text("mine", encoding="utf-8")
    assert main(["read", str(folder), *words, "--c-header", "new.h"]) == 2
    assert [path.name for path in tmp_path.iterdir()] == ["there.py"]


@pytest.mark.parametrize(
    "words",
    [
        [],
        ["--forces", "1,2,3"],
        ["--forces", "0.2,nan"],
        ["--forces=-1,0.2"],
        ["--forces", "200,2000"],
        ["--forces", "0.2,0.5", "press.csv"],
        ["--forces", "-0.5,1"],
        ["nowhere.csv"],
        ["--forces", "0.2,0.5", "--unit", "nowhere.toml"],
        ["--forces", "0.2,0.5", "--classes", "ripe:0.8"],
    ],
    ids=" ".join,
)
def test_wrong_input_is_refused(made, capsys, words):
    folder, _ = made
    assert main(["read", str(folder), *words]) == 2
    answer = capsys.readouterr()
    assert answer.out == ""
    assert answer.err.splitlines()[-1].startswith("pipeline: ")


@pytest.fixture(scope="module")
def deep(tmp_path_factory):
    """Return the folder of the paper sensor at large strain on flesh of nu 0.45, whose table P drifts over."""
    folder = tmp_path_factory.mktemp("deep") / "deep"
    folder.mkdir()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        result = result_of(Design(press=Press(strain="large"), fruit=Fruit(poisson=0.45)))
        write_outputs(result, folder)
    return folder, result


def test_press_at_large_strain_is_read_by_its_table(deep, capsys, tmp_path):
    """The forces of response.csv read as their own modulus, by another law of flesh as another one."""
    folder, result = deep
    table = result.press.table
    rows = zip(table.F[1, :, 0].tolist(), table.F[1, :, 1].tolist(), strict=True)
    lines = "".join(f"{0.001 * place},{soft},{stiff}\n" for place, (soft, stiff) in enumerate(rows))
    path = tmp_path / "press.csv"
    path.write_text("t_s,F_l_N,F_h_N\n" + lines, encoding="utf-8")
    assert main(["read", str(folder), str(path), "--json"]) == 0
    answer = capsys.readouterr()
    reading, E = json.loads(answer.out), float(table.E[1])
    assert reading["E_MPa"] == pytest.approx(E, rel=1e-4)
    assert reading["E_force_ratio_MPa"] == pytest.approx(E, rel=1e-4)
    assert abs(reading["E_hencky_MPa"] / E - 1.0) > 0.01
    assert "log neo-Hooke" in answer.err
    assert "calibrate at the same depth on a body of known E" in answer.err


def test_unit_at_large_strain_is_calibrated_by_weights_and_by_rubbers(deep, capsys, tmp_path):
    folder, result = deep
    K = 1.0 / np.diag(result.springs.C)
    lines = ["tip,weight_g,deflection_mm"]
    lines += [f"{name},{g},{g * 9.80665e-3 / K[i]}" for i, name in enumerate(("low", "high")) for g in (0, 10, 30)]
    weights, rubbers = tmp_path / "weights.csv", tmp_path / "rubbers.csv"
    weights.write_text("\n".join(lines), encoding="utf-8")
    table = result.press.table
    lines = ["rubber,E_MPa,poisson,F_l_N,F_h_N"]
    lines += [f"r{i},{table.E[i]},0.45,{table.F[i, j, 0]},{table.F[i, j, 1]}"
              for i in (1, -1) for j in (3, 7, 11)]  # fmt: skip
    rubbers.write_text("\n".join(lines), encoding="utf-8")
    for measured, precision in ((weights, 1e-9), (rubbers, 1e-3)):
        main(["calibrate", str(folder), str(measured), "--json"])
        answer = capsys.readouterr()
        found = json.loads(answer.out)
        np.testing.assert_allclose(1e-3 * np.array(found["K_N_per_m"]), K, rtol=precision)
        P_max = next(one for one in found["verdicts"] if one["name"] == "P_max")
        assert P_max["value"] == pytest.approx(result.reached.P_max.value, rel=2e-3)
        assert "calibrate at the same depth on a body of known E" in answer.err


@pytest.mark.parametrize(("columns", "cells"), [("E_MPa,poisson", "1,0.49"), ("E_over_1_minus_nu2_MPa", "1.2")])
def test_rubber_of_another_poisson_s_ratio_is_refused_at_large_strain(deep, capsys, tmp_path, columns, cells):
    """One of nu 0.49 calibrated as flesh of nu 0.3 gave K_h half as much again."""
    folder, _ = deep
    path = tmp_path / "rubbers.csv"
    path.write_text(f"rubber,{columns},F_l_N,F_h_N\nsoft,{cells},0.2,0.5\nhard,{cells},0.3,0.9\n", encoding="utf-8")
    assert main(["calibrate", str(folder), str(path)]) == 2
    assert "poisson of rubber soft" in capsys.readouterr().err


def test_firmware_at_large_strain_is_refused_by_name(deep, capsys, tmp_path):
    folder, _ = deep
    assert main(["read", str(folder), "--c-header", str(tmp_path / "unit.h")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "press.strain = 'large': must be 'linear' for firmware" in line
    assert not (tmp_path / "unit.h").exists()


def test_forces_that_tell_nothing_exit_with_one(made, capsys):
    folder, _ = made
    assert main(["read", str(folder), "--forces", "0,0.5"]) == 1
    assert "no modulus  flags: lift_off" in capsys.readouterr().out


def test_reading_imports_no_solver(made):
    """A reading is instant: neither solids nor meshes nor solves are loaded."""
    folder, _ = made
    code = f"""
import sys
from pipeline.cli import main
assert main(["read", {str(folder)!r}, "--forces", "0.37,1.07"]) == 0
print(sorted({{"cadquery", "OCP", "gmsh", "skfem", "pyvista", "scipy"}} & set(sys.modules)))
"""
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True, timeout=600
    )
    assert done.stdout.splitlines()[-1] == "[]"
