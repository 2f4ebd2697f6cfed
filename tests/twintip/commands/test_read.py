"""`pipeline read` and `calibrate` from the command line: forces, files, streams, firmware, and their exit codes."""

import io
import json
import sys
from pathlib import Path

import numpy as np
import pytest
from programs import PYTHON, ended
from stand_ins import CONTACT, result_of

from pipeline.report.outputs import write_outputs
from sensor.design.design_file import design_from_mapping
from sensor.design.processes import PROCESSES
from twintip.cli import main

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


def rows_of(text):
    header, *rows = text.splitlines()
    return header, rows


@pytest.fixture
def answered(capsys):
    """Return a function that runs a command, and returns its exit code and its answers: one, or one a line."""

    def answers_of(*words):
        code = main([*words, "--json"])
        out = capsys.readouterr().out
        return code, [json.loads(out)] if out.startswith("{\n") else [json.loads(line) for line in out.splitlines()]

    return answers_of


@pytest.fixture
def streamed(monkeypatch):
    """Return a function that makes a text the standard input."""
    return lambda text: monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(text.encode())))


def test_forces_of_a_pair(paper, answered):
    forces = ",".join(map(str, paper.forces(1.5)))
    code, (reading,) = answered("read", paper.folder, "--forces", forces, "--classes", "ripe:0.8,unripe")
    assert code == 0
    assert reading.keys() >= {"E_MPa", "E_over_1_minus_nu2_MPa", "u_percent", "tilt_deg", "flags", "class"}
    assert reading["E_MPa"] == pytest.approx(1.5, rel=1e-6)
    assert (reading["class"], reading["flags"]) == ("unripe", ["uncertain"])  # springs as the process scatters them
    assert reading["u_percent"] > 50.0


def test_forces_that_tell_nothing_exit_with_one(paper, answered):
    code, (reading,) = answered("read", paper.folder, "--forces", "0,0.5")
    assert (code, reading["flags"]) == (1, ["lift_off"])


@pytest.mark.parametrize(
    ("header", "flags"),
    [
        ("t_s,F_l_N,F_h_N", []),
        ("", ["--columns", "t=1,F_l=2,F_h=3"]),
    ],
)
def test_file_and_stream_read_alike(header, flags, paper, answered, written, streamed):
    _, rows = rows_of(paper.press(2.5))
    text = "\n".join([header, *rows])
    code, (reading,) = answered("read", paper.folder, written(text), *flags)
    assert (code, reading["E_MPa"]) == (0, pytest.approx(2.5, rel=1e-6))
    streamed(text)
    assert answered("read", paper.folder, "-", *flags) == (0, [reading])
    assert len(answered("read", paper.folder, written(text), "--each", *flags)[1]) > 25


@pytest.mark.parametrize("line", [b"0,\xff\xfe\n", b"0,1,\0\n", b"1" * 70_000], ids=["no text", "NUL", "endless"])
def test_stream_that_is_no_text_is_one_line(line, paper, capsys, monkeypatch):
    stream = io.BytesIO(b"t_s,F_l_N,F_h_N\n" + line)
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(stream))
    assert main(["read", paper.folder, "-"]) == 2
    assert capsys.readouterr().err.splitlines()[-1].startswith("pipeline: -, line 2")


def test_calibrated_unit_is_taken_with_its_classes(paper, answered, tmp_path, written):
    unit = str(tmp_path / "unit.toml")
    weights = written(paper.weights(1.2))
    code, (answer,) = answered("calibrate", paper.folder, weights, "--out", unit, "--classes", "ripe:0.8,unripe")
    assert (code, answer["K_N_per_m"]) == (1, pytest.approx((1.2e3 * paper.K).tolist()))
    assert answer["weighed_after_s"] == 30.0
    forces = ",".join(map(str, paper.forces(1.5, factor=1.2)))
    _, (reading,) = answered("read", paper.folder, "--unit", unit, "--forces", forces)
    pressed = 1.5 * answer["K_press_over_weighed"]  # by springs that did not creep
    assert (reading["E_MPa"], reading["class"]) == (pytest.approx(pressed, rel=1e-3), "unripe")
    with (tmp_path / "unit.toml").open("a", encoding="utf-8") as file:
        file.write("# mine\n")
    assert main(["calibrate", paper.folder, weights, "--out", unit]) == 2


def test_time_of_the_weighing_is_taken_and_told(paper, answered, written):
    """Whatever the columns are called."""
    _, rows = rows_of(paper.weights(1.2))
    own = ["--columns", "force=Gewicht,deflection=3", "--units", "force=g,deflection=mm", "--after", "300"]
    _, (answer,) = answered("calibrate", paper.folder, written("\n".join(["tip,Gewicht,b", *rows])), *own)
    assert answer["K_N_per_m"] == pytest.approx((1.2e3 * paper.K).tolist())
    assert (answer["weighed_after_s"], answer["creep_of"]) == (300.0, "process")
    shares = PROCESSES["fdm-petg"].creep.press_stiffness_ratio(300.0, 3.0)
    assert answer["K_press_over_weighed"] == pytest.approx(shares)


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
    """Return the folder of the pair with a read-out; a reading that is not tilted needs no presses that are."""
    design = design_from_mapping({"readout": {}, "reading": {"tilt_deg": 0.0}})
    return Printed(tmp_path_factory.mktemp("wired") / "wired", design)


BOARD = ["main.py", "sketch/ads1220.h", "sketch/sketch.ino"]


def test_programs_of_the_board_are_written_beside_the_design_or_where_they_should(wired, tmp_path):
    """Nothing that a person wrote is lost."""
    words = ["read", wired.folder, "--logger"]
    assert main(words) == 0
    beside = Path(f"{wired.folder}-board")
    assert sorted(str(path.relative_to(beside)) for path in beside.rglob("*.*")) == BOARD
    mine = tmp_path / "mine"
    words.append(str(mine))
    assert main(words) == 0
    logger = (mine / "main.py").read_bytes()
    assert logger == (beside / "main.py").read_bytes()
    (mine / "sketch/sketch.ino").write_text("mine", encoding="utf-8")
    (mine / "main.py").unlink()
    assert main(words) == 2
    assert not (mine / "main.py").exists()
    assert main([*words, "--force"]) == 0
    assert (mine / "main.py").read_bytes() == logger
    assert (mine / "sketch/sketch.ino.bak").read_text(encoding="utf-8") == "mine"


def test_reading_imports_no_solver(paper):
    """A reading is instant: neither solids nor meshes nor solves are loaded."""
    code = f"""
import sys
from twintip.cli import main
assert main(["read", {paper.folder!r}, "--forces", "0.37,1.07"]) == 0
print(sorted({{"cadquery", "OCP", "gmsh", "skfem", "pyvista", "scipy"}} & set(sys.modules)))
"""
    assert ended(PYTHON, "-c", code).stdout.splitlines()[-1] == "[]"


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
        ("", ["--fruit-presses", "2"], {"1": [1.0, 1.1], "2": [2.2, 2.0], "3": [1.5]}),
        ("aabbc", [], {"a": [1.0, 1.1], "b": [2.2, 2.0], "c": [1.5]}),
    ],
)
def test_presses_of_a_fruit_are_answered_once(names, words, fruits, paper, answered, written, streamed):
    text = presses_of_fruits(paper, [1.0, 1.1, 2.2, 2.0, 1.5], names)
    code, told = answered("read", paper.folder, written(text), *words)
    assert code == 0
    assert all(fruit.keys() >= {"E_MPa", "u_percent", "u_alike_percent", "scatter_percent", "flags"} for fruit in told)
    moduli = {fruit["fruit"]: [press["E_MPa"] for press in fruit["presses"]] for fruit in told}
    assert moduli == {name: pytest.approx(those, rel=1e-6) for name, those in fruits.items()}
    streamed(text)
    assert answered("read", paper.folder, "-", *words) == (0, told)


@pytest.mark.parametrize(("order", "code"), [("bad", 1), ("good bad", 0), ("bad good", 0)])
def test_one_press_that_is_read_is_enough(order, code, paper, answered, written):
    """A bad one has too few samples: every tip touches in two of them only."""
    header, rows = rows_of(paper.press(2.5))
    presses = {"good": rows, "bad": [rows[0], *rows[-2:]]}
    forces = [row.partition(",")[2] for name in order.split() for row in (*presses[name], "t,0,0", "t,0,0")]
    text = "\n".join([header, *(f"{0.02 * number},{row}" for number, row in enumerate(forces))])
    found, readings = answered("read", paper.folder, written(text))
    assert found == code
    assert ["good" if reading["E_MPa"] else "bad" for reading in readings] == order.split()
