"""The commands of docs/read-a-fruit.md run in its order on the tables that the page shows."""

import json
import re
from pathlib import Path

import pytest
from stand_ins import result_of

from pipeline.report.outputs import write_outputs
from sensor.design.design_file import design_from_mapping
from twintip.cli import main

PAGE = (Path(__file__).parents[2] / "docs" / "read-a-fruit.md").read_text(encoding="utf-8")
COMMANDS = {
    "pipeline calibrate outputs/paper weights.csv --out unit.toml --classes ripe:0.8,turning:1.6,unripe": 1,
    "pipeline read outputs/mango --logger": 0,
    "pipeline calibrate outputs/paper counts.csv": 1,
    "pipeline calibrate outputs/paper creep.csv": 1,
    "pipeline calibrate outputs/paper counts.csv --plate plate.csv": 1,
    "pipeline calibrate outputs/paper weights.csv --fruit fruit.csv --out scaled.toml": 1,
    "pipeline read outputs/paper press.csv --unit scaled.toml": 0,
    "pipeline calibrate outputs/paper coupon.csv": 0,
    "pipeline read outputs/paper press.csv --unit unit.toml": 0,
    "pipeline read outputs/paper press.csv --unit unit.toml --json": 0,
    "pipeline read outputs/paper --unit unit.toml --forces 0.404,1.032": 0,
    "pipeline read outputs/paper --unit unit.toml --c-header unit.h": 0,
    "pipeline read outputs/paper --unit unit.toml --micropython unit.py": 0,
}
SOLVED_ELSEWHERE = {
    "pipeline design --set print.E_MPa=1750 --out outputs/second",
    "pipeline modulus rubber.csv --body ball --radius 40 --support plate --poisson 0.49 --poisson-error 0.01 --json",
    "pipeline calibrate outputs/mango weights.csv --ball ball.csv --ball-reduced-modulus 1.4 --ball-radius 40 "
    "--ball-modulus-error 5",
}
"""Those that solve: test_commands.py runs the first, test_reference_presses.py of calibrate the others."""


def tables():
    """Return the tables of the page by the name of their file."""
    names = re.findall(r"`(\w+\.csv)`", PAGE)
    blocks = re.findall(r"^((?:    [\w.]+(?:,[\w.]+)+\n)+)", PAGE, flags=re.MULTILINE)
    return {name: re.sub(r"^    ", "", block, flags=re.MULTILINE) for name, block in zip(names, blocks, strict=True)}


@pytest.fixture(scope="module")
def printed(tmp_path_factory):
    """Run the commands of the page beside its tables; return the folder, and what each command printed."""
    folder = tmp_path_factory.mktemp("read-a-fruit")
    for name, design in {"paper": None, "mango": design_from_mapping({"readout": {}, "reading": {}})}.items():
        made = folder / "outputs" / name
        made.mkdir(parents=True)
        write_outputs(result_of(design), made)
    for name, text in tables().items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder


def printed_lines():
    """Return the lines of output that the page shows: indented, no command, no table and no code."""
    lines = re.findall(r"^    (\S.*)$", re.sub(r"    #include.+?\n\n", "", PAGE, flags=re.DOTALL), flags=re.MULTILINE)
    rows = {row for table in tables().values() for row in table.splitlines()}
    return [line for line in lines if not line.startswith("pipeline ") and line not in rows]


def test_page_shows_what_is_run():
    shown = re.findall(r"^    (pipeline .+)$", PAGE, flags=re.MULTILINE)
    assert set(shown) == {*COMMANDS, *SOLVED_ELSEWHERE}


def test_commands_end_as_they_should(printed, monkeypatch, capsys):
    monkeypatch.chdir(printed)
    answers = {}
    for command, code in COMMANDS.items():
        assert main(command.split()[1:]) == code, command
        answers[command] = capsys.readouterr().out
    shown = printed_lines()
    said = {line.strip() for answer in answers.values() for line in answer.splitlines()}
    assert len(shown) == 12
    assert [line for line in shown if line.strip() not in said] == []
    reading = json.loads(answers["pipeline read outputs/paper press.csv --unit unit.toml --json"])
    assert reading["E_MPa"] == pytest.approx(1.5, rel=0.01 * reading["u_percent"])
    assert reading["class"] == "turning"
    assert {key for key in reading if f"`{key}`" not in PAGE} == set()
    assert (printed / "unit.h").is_file()
    assert (printed / "outputs/mango-board/main.py").is_file()
