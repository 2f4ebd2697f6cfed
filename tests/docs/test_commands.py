"""Every command that the README and the documents show is known to the command line; those of RUN_HERE are run."""

import re
import shlex
import shutil
from pathlib import Path

import pytest

import pipeline
from solve.linear import SolveError
from twintip.cli import main

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
LINE = re.compile(r"^    (?:\.venv/bin/)?((?:pipeline|make) [a-z].+)$", flags=re.MULTILINE)
FENCE = re.compile(r"^```(?:sh|bash|shell|console)\n(.+?)^```", flags=re.MULTILINE | re.DOTALL)
INLINE = re.compile(r"`(?:\.venv/bin/)?((?:pipeline|make) [a-z][^`\n]+)`")
RUN = re.compile(r"pipeline (?:run|design)(?! --list-processes)(?: (?!NAME|DIR)\S+)*")
SCRIPT = re.compile(r"python ((?:docs|tests)/[\w/]+\.py)")

RUN_HERE = {
    "default": [
        "pipeline run --nl 0.05",
        "pipeline design --fields",
        "pipeline view outputs/paper --png pictures",
        "pipeline view outputs/paper --html scenes.html",
        "pipeline explain NL --out outputs/paper",
        "pipeline doctor",
    ],
    "own file": [
        "pipeline design --list-processes",
        "pipeline design --design mine.toml --process sla-resin --out outputs/mine",
        "pipeline check outputs/mine",
    ],
    "compression tests": [
        "pipeline modulus docs/examples/fruit-1.csv docs/examples/fruit-2.csv docs/examples/fruit-3.csv --height 70 "
        "--radius 35",
        "pipeline modulus docs/examples/fruit-1.csv --height 70 --radius 35 --json",
        "pipeline modulus docs/examples/fruit-1.csv --height 70 --radius 35 --plot fruit-1.html",
    ],
    "pins": ["pipeline design --set tips.socket=pin --out outputs/pins"],
    "suggest": ["pipeline suggest paper --set fruit.bruise_limit_MPa=1.2"],
}
"""What is run below, each list in a folder of its own; other runs are taken up to their first solve."""

SLOW = ("compression tests",)  # the others are studies: tests of each command run it too

OTHER_FRUIT = [
    'pipeline suggest --fruit "radius 26, E 0.3 to 2" --out kiwi.toml',
    'pipeline suggest --fruit "radius 45 to 52 by 90 to 130, flesh 9 to 18, E 0.5 to 3" --out my-mango.toml',
    "pipeline run --design kiwi",
    "pipeline run --design apple",
    "pipeline run --design peach",
    "pipeline run --design avocado",
    "pipeline run --design tomato",
    "pipeline run --design orange",
    "pipeline run --design pear",
    "pipeline run --design plum",
]


def commands(text):
    """Return the commands that a text shows in indented lines, in shell blocks and in its sentences."""
    fenced = (line for block in FENCE.findall(text) for line in block.splitlines())
    shown = [*LINE.findall(text), *INLINE.findall(text), *LINE.findall("\n".join(f"    {line}" for line in fenced))]
    return {re.split(r"\s+#", command)[0].strip() for command in shown}


def shown():
    return sorted(set().union(*(commands(page.read_text(encoding="utf-8")) for page in PAGES)))


@pytest.mark.parametrize("command", [command for command in shown() if command.startswith("pipeline")])
def test_shown_command_is_known(command, capsys):
    _, name, *words = shlex.split(command)
    assert main([name, "-h"]) == 0
    text = capsys.readouterr().out
    assert [word for word in words if word.startswith("-") and not re.search(rf"{word}\b", text)] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_shown_script_exists(page):
    assert [path for path in SCRIPT.findall(page.read_text(encoding="utf-8")) if not (ROOT / path).is_file()] == []


@pytest.fixture
def pages_folder(tmp_path, monkeypatch):
    """Return an empty current folder with the examples of the documents; `mine.toml` is that of docs/design-file.md."""
    page = (ROOT / "docs" / "design-file.md").read_text(encoding="utf-8")
    example = re.search(r"(?:^    .*\n|^\n)*^    name = (?:.*\n)(?:    .*\n|\n)*", page, flags=re.MULTILINE)
    assert example is not None
    monkeypatch.chdir(tmp_path)
    shutil.copytree(ROOT / "docs" / "examples", tmp_path / "docs" / "examples")
    (tmp_path / "mine.toml").write_text(re.sub(r"^    ", "", example[0], flags=re.MULTILINE), encoding="utf-8")
    return tmp_path


@pytest.mark.usefixtures("pages_folder")
@pytest.mark.parametrize("command", [line for line in shown() if RUN.fullmatch(line)])
def test_shown_run_reaches_its_first_solve(command, monkeypatch):
    asked = []

    def run(*design_and_options, **_):
        asked.append(design_and_options)
        raise SolveError(command)

    monkeypatch.setattr(pipeline, "run", run)
    assert main(command.split()[1:]) == 2
    assert len(asked) == 1


@pytest.mark.study
@pytest.mark.usefixtures("pages_folder")
@pytest.mark.parametrize("command", OTHER_FRUIT)
def test_sensors_of_other_fruit_pass(command):
    assert main(shlex.split(command)[1:]) == 0


@pytest.mark.parametrize(
    "chain",
    [pytest.param(name, marks=pytest.mark.slow if name in SLOW else pytest.mark.study) for name in RUN_HERE],
)
@pytest.mark.usefixtures("pages_folder")
def test_shown_commands_pass(chain):
    assert [command for command in RUN_HERE[chain] if main(shlex.split(command)[1:]) != 0] == []
