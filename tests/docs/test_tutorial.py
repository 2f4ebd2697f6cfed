"""docs/from-test-to-firmware.md: its commands run in their order, and the numbers that it shows come out."""

import re
import runpy
import shutil
import subprocess
from pathlib import Path

import pytest

from pipeline.cli import main

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "from-test-to-firmware.md").read_text(encoding="utf-8")
TRUTH_MPA = 1.5  # of the fruit in press.csv
ONE_PERCENT = 0.01  # what another processor's meshes may move a number by


def commands():
    return [line.split()[1:] for line in PAGE.splitlines() if line.startswith("    pipeline ")]


def number(pattern, text):
    """Return the one number that a text has in the place of a pattern's group."""
    found = re.findall(pattern, text)
    assert len(found) == 1
    return float(found[0])


def test_page_has_the_whole_chain():
    assert [words[0] for words in commands()] == ["modulus", "run", "calibrate", "read", "read", "read"]


@pytest.mark.slow
def test_chain_runs_from_curves_to_c(tmp_path, monkeypatch, capsys):
    """The fruit of the press is read within the error bar that is printed, by the commands, in C and in MicroPython."""
    monkeypatch.chdir(tmp_path)
    shutil.copytree(ROOT / "docs" / "examples", tmp_path / "docs" / "examples")
    answers = []
    for words in commands():
        assert main(words) == 0
        answers.append(capsys.readouterr().out)
    tests, _, weighed, press, single, _ = answers
    shown = re.search(r"`E_max_MPa = [\d.]+`", PAGE)
    assert shown is not None
    assert shown[0].strip("`") in tests.splitlines()
    assert re.search(r"-4[67]\.\d %", weighed)  # E with the stiffnesses of the design
    E, error = number(r"E ([\d.]+) MPa", press), number(r"\+- (\d+) %", press)
    assert abs(E / TRUTH_MPA - 1.0) < 0.01 * error
    assert pytest.approx(number(r"MPa  E ([\d.]+) MPa", PAGE), rel=ONE_PERCENT) == E
    assert number(r"prints ([\d.]+) MPa", PAGE) == pytest.approx(E, rel=ONE_PERCENT)
    moment, bar = number(r'"E_MPa": ([\d.]+)', single), number(r'"u_percent": ([\d.]+)', single)
    assert abs(moment / TRUTH_MPA - 1.0) < 0.01 * bar
    assert in_micropython() == pytest.approx(E, rel=1e-3)  # E is printed to four digits
    if shutil.which("cc"):
        assert in_c() == pytest.approx(E, abs=1e-3)


def in_micropython():
    module = runpy.run_path("sensor.py")
    press = module["Press"]()
    for line in Path("docs/examples/press.csv").read_text(encoding="utf-8").splitlines()[1:]:
        press.add([float(cell) for cell in line.split(",")[2:]])
    E: float = press.read()[0]
    return E


def in_c():
    """Compile the page's program by the page's command and run it."""
    source, command = (
        re.search(r"^```c\n(.+?)^```", PAGE, flags=re.M | re.S),
        re.search(r"^    (cc .+)$", PAGE, flags=re.M),
    )
    assert source is not None
    assert command is not None
    Path("main.c").write_text(source[1], encoding="utf-8")
    subprocess.run(command[1].split(), check=True, timeout=600)
    with Path("docs/examples/press.csv").open(encoding="utf-8") as lines:
        said = subprocess.run(["./main"], stdin=lines, check=True, capture_output=True, encoding="utf-8").stdout
    return number(r"E ([\d.]+) MPa", said)
