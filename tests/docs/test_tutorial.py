"""docs/tutorial.md: its commands run in their order, and the numbers that it shows come out."""

import re
import runpy
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from programs import ended
from tutorial_press import NOISE_N, TARE, WAY, shown_forces

from sensor.design.processes import PROCESSES
from twintip.cli import main

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")
TRUTH_MPA = 1.5  # of the fruit in press.csv and in press-counts.csv


def commands():
    return [line.split()[1:] for line in PAGE.splitlines() if line.startswith("    pipeline ")]


def number(pattern, text):
    """Return the one number that a text has in the place of a pattern's group."""
    found = re.findall(pattern, text)
    assert len(found) == 1
    return float(found[0])


def shown_as_printed(pattern, printed):
    """Say whether the page shows numbers that were printed, each to the digits that the page has."""
    found = re.findall(pattern, re.sub(r"\s+", " ", PAGE))
    assert len(found) == 1
    shown = [found[0]] if isinstance(found[0], str) else found[0]
    digits = [len(number.partition(".")[2]) for number in shown]
    return list(shown) == [f"{float(value):.{digit}f}" for value, digit in zip(printed, digits, strict=True)]


@pytest.mark.study
def test_press_is_that_of_boundary_elements():
    """The forces of the file, but for their noise and its five digits."""
    forces = np.loadtxt(ROOT / "docs" / "examples" / "press.csv", delimiter=",", skiprows=1)[:, 2:]
    assert forces[TARE : TARE + len(WAY)] == pytest.approx(shown_forces(WAY), abs=5.0 * NOISE_N)


@pytest.mark.slow
def test_chain_runs_from_curves_to_c(tmp_path, monkeypatch, capsys):
    """The counts of a press are read within the printed error bar, by the commands, in C and in MicroPython."""
    monkeypatch.chdir(tmp_path)
    shutil.copytree(ROOT / "docs" / "examples", tmp_path / "docs" / "examples")
    answers = []
    for words in commands():
        assert main(["3" if word == "60" else word for word in words]) == 0  # 60 presses take two minutes
        answers.append(capsys.readouterr().out)
    _, tests, _, run, weighed, press, by_radius, newtons, _, proof = answers
    assert proof.endswith("\nproved\n")
    (shown,) = re.findall(r"`(E_max_MPa = [\d.]+)`", PAGE)
    assert shown in tests.splitlines()
    for verdict, printed in (("reading.bias", run), ("reading.uncertainty", run), ("unit.uncertainty", weighed)):
        assert shown_as_printed(rf"`{verdict}`[ is|]+([\d.]+) ", re.findall(rf"{verdict} +│ ([\d.]+) ", printed))
    assert shown_as_printed(
        r"low springs of this unit have ([\d.]+) and ([\d.]+) N/m instead of 150, its high ones ([\d.]+) and ([\d.]+)",
        [re.findall(rf"^{tip} +K +([\d.]+)", weighed, flags=re.M)[0] for tip in ("low_1", "low_2", "high_1", "high_2")],
    )
    (line,) = re.findall(r"^    (t 0\.700 s .+)$", PAGE, flags=re.M)
    assert line in press.splitlines()
    found = re.findall(r"MPa  E ([\d.]+) MPa ± ([\d.e+]+) %", newtons)
    assert shown_as_printed(r"Now E is ([\d.]+) MPa ± (\d+) %", found[0])
    E, error = number(r"E ([\d.]+) MPa", press), number(r"± ([\d.]+) % \(95", press)
    assert abs(E / TRUTH_MPA - 1.0) < 0.01 * error
    counted = in_micropython()
    assert shown_as_printed(r"prints ([\d.]+) MPa", [f"{counted:.3f}"])
    assert "flags" not in press
    known, bar = number(r'"E_MPa": ([\d.]+)', by_radius), number(r'"u_percent": ([\d.]+)', by_radius)
    assert abs(known / TRUTH_MPA - 1.0) < 0.01 * bar
    # From the touch at 0.2 s to 0.7 s by the command, 3 s by firmware; E is printed to two decimals.
    assert PROCESSES["fdm-petg"].creep.growth(0.5, 3.0) * counted == pytest.approx(E, abs=0.005)
    if shutil.which("cc"):
        assert in_c() == pytest.approx(counted, abs=1e-3)


def in_micropython():
    module = runpy.run_path("outputs/sensor.py")
    lines = Path("docs/examples/press-counts.csv").read_text(encoding="utf-8").splitlines()[1:]
    ((E, _, _),) = module["readings"]([int(cell) for cell in line.split(",")[1:]] for line in lines)
    assert isinstance(E, float)
    return E


def in_c():
    """Compile the page's program by the page's command and run it."""
    (source,) = re.findall(r"^```c\n(.+?)^```", PAGE, flags=re.M | re.S)
    (command,) = re.findall(r"^    (cc .+)$", PAGE, flags=re.M)
    Path("outputs/main.c").write_text(source, encoding="utf-8")
    assert ended(*command.split(), cwd=Path.cwd()).returncode == 0
    with Path("docs/examples/press-counts.csv").open(encoding="utf-8") as lines:
        said = subprocess.run(["outputs/main"], stdin=lines, check=True, capture_output=True, encoding="utf-8").stdout
    return number(r"E ([\d.]+) MPa", said)
