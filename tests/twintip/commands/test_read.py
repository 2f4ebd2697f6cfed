"""`pipeline read` and `calibrate` from the command line: forces, files, streams, firmware, and their exit codes."""

import io
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from deadline import DEADLINE_S
from stand_ins import CONTACT, result_of

from pipeline.report.outputs import write_outputs
from sensor.design.design_file import design_from_mapping
from sensor.design.processes import PROCESSES
from twintip.cli import main

ROOT = Path(__file__).parents[4]
GRAM = 9.80665e-3  # [N]


class Printed:
    """The folder of a sensor whose contact and springs stand in for solved ones, and its result."""

    def __init__(self, folder, design):
        folder.mkdir()
        self.folder = str(folder)
        self.result = result_of(design)
        self.K = 1.0 / np.diag(self.result.springs.C)
        write_outputs(self.result, folder)

    def forces(self, E, travel=0.6, factor=1.0):
        """Return the forces [N] of a unit whose springs are stiffer by a factor, on linear flesh."""
        return np.linalg.solve(self.result.springs.C / factor + CONTACT.S / E, [travel, travel])

    def press(self, E):
        rows = [",".join(map(str, self.forces(E, x))) for x in np.linspace(0.02, 0.6, 30)]
        return "t_s,F_l_N,F_h_N\n" + "".join(f"{0.001 * index},{row}\n" for index, row in enumerate(rows))

    def weights(self, factor):
        lines = ["tip,weight_g,deflection_mm"]
        for name, K in zip(("low", "high"), self.K, strict=True):
            lines += [f"{name},{g},{g * GRAM / K / factor}" for g in (0, 10, 30)]
        return "\n".join(lines)


@pytest.fixture(scope="module")
def paper(tmp_path_factory):
    return Printed(tmp_path_factory.mktemp("read") / "paper", None)


@pytest.fixture
def written(tmp_path):
    """Return a function that writes a table and returns its path."""

    def path_of(text, name="table.csv"):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return str(path)

    return path_of


def test_forces_of_a_pair(paper, capsys):
    forces = ",".join(map(str, paper.forces(1.5)))
    assert main(["read", paper.folder, "--forces", forces, "--json", "--classes", "ripe:0.8,unripe"]) == 0
    reading = json.loads(capsys.readouterr().out)
    assert reading.keys() >= {"E_MPa", "E_over_1_minus_nu2_MPa", "u_percent", "tilt_deg", "flags", "class"}
    assert reading["E_MPa"] == pytest.approx(1.5, rel=1e-6)
    assert (reading["class"], reading["flags"]) == ("unripe", ["uncertain"])  # springs as the process scatters them
    assert reading["u_percent"] > 50.0


def test_forces_that_tell_nothing_exit_with_one(paper, capsys):
    assert main(["read", paper.folder, "--forces", "0,0.5"]) == 1
    assert "lift_off" in capsys.readouterr().out


def test_file_and_stream_read_alike(paper, capsys, monkeypatch, written):
    text = paper.press(2.5)
    assert main(["read", paper.folder, "--json", written(text)]) == 0
    from_file = capsys.readouterr().out
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(text.encode())))
    assert main(["read", paper.folder, "-", "--json"]) == 0
    assert capsys.readouterr().out == from_file
    (line,) = from_file.splitlines()
    assert json.loads(line)["E_MPa"] == pytest.approx(2.5, rel=1e-6)
    assert main(["read", paper.folder, written(text), "--each"]) == 0
    assert len(capsys.readouterr().out.splitlines()) > 25


@pytest.mark.parametrize("line", [b"0,\xff\xfe\n", b"0,1,\0\n", b"1" * 70_000], ids=["no text", "NUL", "endless"])
def test_stream_that_is_no_text_is_one_line(line, paper, capsys, monkeypatch):
    stream = io.BytesIO(b"t_s,F_l_N,F_h_N\n" + line)
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(stream))
    assert main(["read", paper.folder, "-"]) == 2
    assert capsys.readouterr().err.splitlines()[-1].startswith("pipeline: -, line 2")


def test_calibrated_unit_is_taken_with_its_classes(paper, capsys, tmp_path, written):
    unit = str(tmp_path / "unit.toml")
    weights = written(paper.weights(1.2))
    assert main(["calibrate", paper.folder, weights, "--out", unit, "--classes", "ripe:0.8,unripe"]) == 1
    capsys.readouterr()
    assert main(["calibrate", paper.folder, weights, "--json"]) == 1
    answer = json.loads(capsys.readouterr().out)
    stiffer = 1.2 * answer["K_press_over_weighed"]
    assert answer["K_press_over_weighed"] == pytest.approx(PROCESSES["fdm-petg"].creep.press_over_weighed(30.0, 3.0))
    assert answer["table"][0]["with_design_stiffness_percent"] == pytest.approx(100.0 / stiffer - 100.0, abs=0.1)
    assert answer["K_N_per_m"] == pytest.approx((1.2e3 * paper.K).tolist())
    forces = ",".join(map(str, paper.forces(1.5, factor=1.2)))
    assert main(["read", paper.folder, "--unit", unit, "--forces", forces, "--json"]) == 0
    reading = json.loads(capsys.readouterr().out)
    pressed = 1.5 * answer["K_press_over_weighed"]  # by springs that did not creep
    assert (reading["E_MPa"], reading["class"]) == (pytest.approx(pressed, rel=1e-3), "unripe")
    with (tmp_path / "unit.toml").open("a", encoding="utf-8") as file:
        file.write("# mine\n")
    assert main(["calibrate", paper.folder, weights, "--out", unit]) == 2


def test_time_of_the_weighing_is_taken_and_told(paper, capsys, written):
    weights = written(paper.weights(1.2))
    found = {}
    for words in ([], ["--after", "30"], ["--after", "300"]):
        assert main(["calibrate", paper.folder, weights, "--json", *words]) == 1
        answer = json.loads(capsys.readouterr().out)
        found[answer["weighed_after_s"]] = answer["K_press_over_weighed"]
        assert answer["creep_of"] == "process"
    assert found[300.0] / found[30.0] == pytest.approx(1.0 + PROCESSES["fdm-petg"].creep_per_decade)
    assert main(["calibrate", paper.folder, weights]) == 1
    assert "30 s after a weight was hung" in capsys.readouterr().out


def test_firmware_is_written_and_not_over_another_file(paper, capsys, tmp_path):
    header, module = tmp_path / "unit.h", tmp_path / "unit.py"
    words = ["read", paper.folder, "--c-header", str(header), "--micropython", str(module)]
    assert main(words) == 0
    assert capsys.readouterr().out.split() == [str(header), str(module)]
    header.write_text("mine", encoding="utf-8")
    assert main(words) == 2
    assert header.read_text(encoding="utf-8") == "mine"
    assert main([*words, "--force"]) == 0


@pytest.fixture(scope="module")
def wired(tmp_path_factory):
    """Return the folder of the pair with a read-out."""
    return Printed(tmp_path_factory.mktemp("wired") / "wired", design_from_mapping({"readout": {}, "reading": {}}))


BOARD = ["main.py", "sketch/ads1220.h", "sketch/sketch.ino"]


@pytest.mark.parametrize(("flags", "place"), [([], "wired-board"), (["mine"], "mine")])
def test_programs_of_the_board_are_written_beside_the_design_or_where_they_should(
    flags, place, wired, capsys, tmp_path, monkeypatch
):
    """Nothing that a person wrote is lost."""
    monkeypatch.chdir(tmp_path)
    folder = (tmp_path if flags else Path(wired.folder).parent) / place
    words = ["read", wired.folder, "--logger", *flags]
    assert main(words) == 0
    assert sorted(str(path.relative_to(folder)) for path in folder.rglob("*.*")) == BOARD
    assert len(capsys.readouterr().out.split()) == len(BOARD)
    logger = (folder / "main.py").read_text(encoding="utf-8")
    (folder / "sketch/sketch.ino").write_text("mine", encoding="utf-8")
    (folder / "main.py").unlink()
    assert main(words) == 2
    assert capsys.readouterr().err.startswith("pipeline: --logger = ")
    assert not (folder / "main.py").exists()
    assert main([*words, "--force"]) == 0
    assert (folder / "main.py").read_text(encoding="utf-8") == logger
    assert (folder / "sketch/sketch.ino.bak").read_text(encoding="utf-8") == "mine"


def test_programs_of_the_board_print_readings_of_a_unit_with_counts(wired, capsys, tmp_path, written):
    keys, tips = "counts_l,counts_h", ("low", "high")
    lines = [f"tip,weight_g,deflection_mm,{keys}"]
    for tip, name in enumerate(tips):
        for gram in (0, 10, 30):
            counts = [4_000_000 + (50_000 * gram if channel == tip else 0) for channel in range(2)]
            lines.append(",".join(map(str, [name, gram, gram * GRAM / wired.K[tip], *counts])))
    unit = str(tmp_path / "unit.toml")
    main(["calibrate", wired.folder, written("\n".join(lines)), "--out", unit])
    words = ["read", wired.folder, "--unit", unit, "--logger", str(tmp_path / "board")]
    assert main([*words, "--micropython", str(tmp_path / "unit.py"), "--c-header", str(tmp_path / "unit.h")]) == 0
    for file, same in (("unit.py", "main.py"), ("unit.h", "sketch/unit.h")):
        assert (tmp_path / file).read_bytes() == (tmp_path / "board" / same).read_bytes()
    capsys.readouterr()
    main(["calibrate", wired.folder, written(wired.weights(1.0)), "--out", unit, "--force"])
    assert main([*words, "--force"]) == 2
    assert capsys.readouterr().err.splitlines()[-1].startswith("pipeline: --unit = ")


def test_reading_imports_no_solver(paper):
    """A reading is instant: neither solids nor meshes nor solves are loaded."""
    code = f"""
import sys
from twintip.cli import main
assert main(["read", {paper.folder!r}, "--forces", "0.37,1.07"]) == 0
print(sorted({{"cadquery", "OCP", "gmsh", "skfem", "pyvista", "scipy"}} & set(sys.modules)))
"""
    command = [sys.executable, "-c", code]
    out = subprocess.run(
        command, cwd=ROOT, capture_output=True, encoding="utf-8", check=True, timeout=DEADLINE_S
    ).stdout
    assert out.splitlines()[-1] == "[]"


def rows_of(text):
    header, *rows = text.splitlines()
    return header, rows


def test_weights_with_notes_and_other_headers_calibrate_alike(paper, capsys, written):
    header, rows = rows_of(paper.weights(1.2))
    tables = {
        "plain": ("\n".join([header, *rows]), []),
        "notes": ("\n".join([f"{header},note", *(f'{row},"ok, dry"' for row in rows)]), []),
        "lines above": (
            "\n".join(["Operator;Smith", "", header.replace(",", ";"), *(row.replace(",", ";") for row in rows)]),
            [],
        ),
        "named": (
            "\n".join(["tip,Gewicht,b", *rows]),
            ["--columns", "force=Gewicht,deflection=3", "--units", "force=g,deflection=mm"],
        ),
        "no header": ("\n".join(rows), ["--columns", "tip=1,force=2,deflection=3", "--units", "force=g,deflection=mm"]),
    }
    answers = []
    for text, flags in tables.values():
        assert main(["calibrate", paper.folder, written(text), "--json", *flags]) == 1
        out, err = capsys.readouterr()
        assert sum("tip = " in line for line in err.splitlines()) == 1
        answers.append(json.loads(out)["K_N_per_m"])
    assert answers == [answers[0]] * len(tables)


def test_press_of_a_board_reads_alike(paper, capsys, monkeypatch, written):
    """The clock of a serial monitor is the time where no column is."""
    text = paper.press(2.5)
    header, rows = rows_of(text)
    clocked = [f"12:34:{float(row.split(',')[0]):06.3f} -> {row.split(',', 1)[1]}" for row in rows]
    presses = {
        "plain": (text, []),
        "banner": (f"boot\nHX711 ready\n\n{text}", []),
        "other columns": ("\n".join([f"{header},note,Load rate", *(f"{row},a,1" for row in rows)]), []),
        "clock": ("\n".join(["12:34:00.000 -> F_l_N,F_h_N", *clocked]), []),
        "no header": ("\n".join(rows), ["--columns", "t=1,F_l=2,F_h=3"]),
        "named": (
            "\n".join(["Zeit [s];Kanal A (N);Kanal B (N)", *(row.replace(",", ";") for row in rows)]),
            ["--columns", "F_l=Kanal A,F_h=3"],
        ),
    }
    for name, (press, flags) in presses.items():
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(press.encode())))
        for source in (written(press), "-"):
            assert main(["read", paper.folder, source, "--json", *flags]) == 0, name
            out, err = capsys.readouterr()
            assert json.loads(out)["E_MPa"] == pytest.approx(2.5, rel=1e-6)
            assert sum("F_l = " in line for line in err.splitlines()) == 1


def presses_of_fruits(paper, moduli, names=""):
    """Return a file of presses of fruit of these moduli, with lifts between, and with names of the fruit if given."""
    header, _ = rows_of(paper.press(1.0))
    lines = [header + ",fruit" * bool(names)]
    for number, E in enumerate(moduli):
        for row in (*rows_of(paper.press(E))[1], "0,0,0", "0,0,0"):
            t = 0.02 * len(lines)
            lines.append(",".join([f"{t}", row.partition(",")[2], *names[number : number + 1]]))
    return "\n".join(lines)


@pytest.mark.parametrize(
    ("names", "words", "fruits"),
    [
        ("", ["--fruit-presses", "0"], [("1", [1.0, 1.1, 2.2, 2.0, 1.5])]),
        ("", ["--fruit-presses", "2"], [("1", [1.0, 1.1]), ("2", [2.2, 2.0]), ("3", [1.5])]),
        ("", ["--fruit-presses", "1"], [(f"{k + 1}", [E]) for k, E in enumerate((1.0, 1.1, 2.2, 2.0, 1.5))]),
        ("aabbc", [], [("a", [1.0, 1.1]), ("b", [2.2, 2.0]), ("c", [1.5])]),
    ],
)
def test_presses_of_a_fruit_are_answered_once(names, words, fruits, paper, capsys, monkeypatch, written):
    text = presses_of_fruits(paper, [1.0, 1.1, 2.2, 2.0, 1.5], names)
    assert main(["read", paper.folder, "--json", written(text), *words]) == 0
    out = capsys.readouterr().out
    told = [json.loads(line) for line in out.splitlines()]
    for fruit, (name, moduli) in zip(told, fruits, strict=True):
        assert fruit.keys() >= {"E_MPa", "u_percent", "u_alike_percent", "scatter_percent", "flags", "class"}
        assert (fruit["fruit"], fruit["counted"]) == (name, len(moduli))
        assert [press["E_MPa"] for press in fruit["presses"]] == pytest.approx(moduli, rel=1e-6)
        assert ("few_presses" in fruit["flags"]) is (len(moduli) == 1 and words != ["--fruit-presses", "1"])
        assert ("presses_disagree" in fruit["flags"]) is (len(moduli) > 1)
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(text.encode())))
    assert main(["read", paper.folder, "-", "--json", *words]) == 0
    assert capsys.readouterr().out == out
    assert main(["read", paper.folder, written(text), *words]) == 0
    assert len(capsys.readouterr().out.splitlines()) == len(fruits) + 5


def test_a_column_of_fruit_leaves_each_sample_as_it_is(paper, capsys, written):
    answers = []
    for names in ("", "a"):
        assert main(["read", paper.folder, written(presses_of_fruits(paper, [1.0], names)), "--json", "--each"]) == 0
        answers.append(capsys.readouterr().out)
    assert answers[0] == answers[1]


@pytest.mark.parametrize(("order", "code"), [("good", 0), ("bad", 1), ("good bad", 0), ("bad good", 0)])
def test_one_press_that_is_read_is_enough(order, code, paper, capsys, written):
    """A bad one has too few samples: every tip touches in two of them only."""
    header, rows = rows_of(paper.press(2.5))
    forces = [row.partition(",")[2] for row in rows]
    presses = {"good": forces, "bad": [forces[0], *forces[-2:]]}
    lines = [line for name in order.split() for line in (*presses[name], "0,0", "0,0")]
    text = "\n".join([header, *(f"{0.02 * number},{line}" for number, line in enumerate(lines))])
    assert main(["read", paper.folder, written(text), "--json"]) == code
    readings = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert ["good" if reading["E_MPa"] else "bad" for reading in readings] == order.split()
