"""Every command that the README and the documents show is known to the command line, and is run: here or elsewhere."""

import re
import shutil
from pathlib import Path

import pytest

from pipeline.cli import main

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
LINE = re.compile(r"^    (?:\.venv/bin/)?((?:pipeline|make) [a-z].+)$", flags=re.MULTILINE)
FENCE = re.compile(r"^```(?:sh|bash|shell|console)\n(.+?)^```", flags=re.MULTILINE | re.DOTALL)
INLINE = re.compile(r"`(?:\.venv/bin/)?((?:pipeline|make) [a-z][^`\n]+)`")
SCRIPT = re.compile(r"python ((?:docs|tests)/[\w/]+\.py)")

RUN_HERE = {
    "pipeline run --nl 0.05": 0,
    "pipeline run --nl 0.03 --p-max 6 --out outputs/mine": 0,
    "pipeline run --set fruit.height_mm=20 --set tips.side_mm=1.5": 0,
    "pipeline check outputs/mine": 0,
    "pipeline run --design mine.toml --process sla-resin": 0,
    "pipeline design --design mine.toml --process sla-resin --out outputs/mine": 0,
    "pipeline design": 0,
    "pipeline design --list-processes": 0,
    "pipeline design --set tips.socket=pin --out outputs/pins": 0,
    "pipeline run --design mango": 0,
    "pipeline run --design paper-on-mango": 1,
    "pipeline design --set print.gauges=foil --out outputs/gauged": 0,
    "pipeline run --set springs.K_l_N_per_m=880 --set springs.K_h_N_per_m=20100 --out outputs/unit": 1,
    "pipeline design --fields": 0,
    "pipeline view outputs/paper --png pictures": 0,
    "pipeline view outputs/paper --html scenes.html": 0,
    "pipeline view outputs/paper --pvd press": 0,
    "pipeline design --set print.E_MPa=1750 --out outputs/second": 0,
    "pipeline doctor": 0,
    "pipeline explain NL --out outputs/paper": 0,
    "pipeline run --design mango --set reading.noise_percent= --out outputs/mine": 0,
    "pipeline suggest paper --set fruit.bruise_limit_MPa=0.29": 0,
    "pipeline modulus docs/examples/fruit-1.csv docs/examples/fruit-2.csv docs/examples/fruit-3.csv --height 70 "
    "--radius 35": 0,
    "pipeline modulus docs/examples/fruit-1.csv --height 70 --radius 35 --json": 0,
    "pipeline run --design docs/examples/kiwi.toml": 0,
    "pipeline modulus docs/examples/fruit-1.csv --height 70 --radius 35 --plot fruit-1.svg": 0,
}
"""What is run below in one folder, in this order, with its exit code."""

ELSEWHERE = {
    "make run": ("Makefile", "$(BIN)/pipeline run --nl 0.05"),
    "make setup": ("Makefile", "lint: setup"),
    "make test": (".ci/run", "make test"),
    "make bench-peers": ("tests/benchmarks/test_benchmarks.py", "peer_says"),
    "pipeline run --fruit-stiffness hayes": ("tests/pipeline/test_run.py", '"--fruit-stiffness", "hayes"'),
    "pipeline run --json": ("tests/pipeline/test_bad_input.py", '"tips.spacing_mm=6", "--json"'),
    "pipeline run --tol 0.02": ("tests/pipeline/test_run.py", '"--tol", "0.02"'),
    **{
        command: ("tests/docs/test_read_a_fruit.py", command)
        for command in (
            "pipeline calibrate outputs/paper weights.csv --out unit.toml --classes ripe:0.8,turning:1.6,unripe",
            "pipeline calibrate outputs/paper rubbers.csv",
            "pipeline calibrate outputs/paper coupon.csv",
            "pipeline read outputs/paper press.csv --unit unit.toml --json",
            "pipeline read outputs/paper --unit unit.toml --forces 0.411,1.076",
            "pipeline read outputs/paper --unit unit.toml --c-header unit.h",
            "pipeline read outputs/paper --unit unit.toml --micropython unit.py",
        )
    },
    "pipeline study springs.toml --export springs.csv --processes 8": (
        "tests/pipeline/study/test_execute.py",
        '"--export", str(csv)',
    ),
    "pipeline study springs.toml --scheduler tcp://10.0.0.5:8786": (
        "tests/pipeline/study/workers/test_engines.py",
        '"--scheduler", address',
    ),
    "pipeline optimise sharper.toml": ("tests/pipeline/study/test_optimum.py", 'main(["optimise", str(written(text))'),
    "pipeline run --design docs/examples/my-fruit.toml": ("tests/docs/test_tutorial.py", '"from-test-to-firmware.md"'),
    "pipeline calibrate outputs/my-fruit docs/examples/weights.csv --out unit.toml "
    "--classes ripe:1.1,turning:2.3,unripe": ("tests/docs/test_tutorial.py", '"from-test-to-firmware.md"'),
    "pipeline read outputs/my-fruit docs/examples/press.csv --unit unit.toml": (
        "tests/docs/test_tutorial.py",
        '"from-test-to-firmware.md"',
    ),
    "pipeline read outputs/my-fruit --forces 0.04857,0.46945,0.08482,0.48648 --unit unit.toml --json": (
        "tests/docs/test_tutorial.py",
        '"from-test-to-firmware.md"',
    ),
    "pipeline read outputs/my-fruit --unit unit.toml --c-header sensor.h --micropython sensor.py": (
        "tests/docs/test_tutorial.py",
        '"from-test-to-firmware.md"',
    ),
}
"""The file that runs a command, and words by which one finds the place."""


def commands(text: str) -> set[str]:
    """Return the commands that a text shows in indented lines, in shell blocks and in its sentences."""
    fenced = (line for block in FENCE.findall(text) for line in block.splitlines())
    shown = [*LINE.findall(text), *INLINE.findall(text), *LINE.findall("\n".join(f"    {line}" for line in fenced))]
    return {re.split(r"\s+#", command)[0].strip() for command in shown}


def shown() -> list[str]:
    return sorted(set().union(*(commands(page.read_text(encoding="utf-8")) for page in PAGES)))


def is_run(command: str) -> bool:
    """Say whether a command is run, or is part of one that is."""
    words = command.split()
    wholes = (whole.split() for whole in (*RUN_HERE, *ELSEWHERE))
    return any(words[:2] == whole[:2] and set(words) <= set(whole) for whole in wholes)


def test_commands_are_found() -> None:
    text = "x\n    .venv/bin/pipeline run --nl 1   # why\n    pipeline  IN\n\n```sh\nmake test\n```\n"
    assert commands(text + "and `pipeline doctor`, not `apt make`.\n") == {
        "pipeline run --nl 1",
        "make test",
        "pipeline doctor",
    }
    assert {"make run", "make test", "pipeline design"} <= set(shown())


@pytest.mark.parametrize("command", [command for command in shown() if command.startswith("pipeline")])
def test_shown_command_is_known(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    _, name, *words = command.split()
    assert main([name, "-h"]) == 0
    text = capsys.readouterr().out
    assert [word for word in words if word.startswith("-") and not re.search(rf"{word}\b", text)] == []


@pytest.mark.parametrize("command", shown())
def test_shown_command_is_run(command: str) -> None:
    assert is_run(command)


def test_command_that_nobody_runs_is_seen() -> None:
    assert not is_run("pipeline run --design nobody")
    assert is_run("pipeline run --nl 0.03")


@pytest.mark.parametrize("command", ELSEWHERE)
def test_place_that_runs_a_command_exists(command: str) -> None:
    path, words = ELSEWHERE[command]
    assert words in (ROOT / path).read_text(encoding="utf-8")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_shown_script_exists(page: Path) -> None:
    assert [path for path in SCRIPT.findall(page.read_text(encoding="utf-8")) if not (ROOT / path).is_file()] == []


@pytest.mark.slow
def test_commands_end_as_they_should(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`mine.toml` is the example of docs/design-file.md."""
    example = re.search(r"(?:^    .*\n|^\n)*^    name = (?:.*\n)(?:    .*\n|\n)*", design_page(), flags=re.MULTILINE)
    assert example is not None
    monkeypatch.chdir(tmp_path)
    shutil.copytree(ROOT / "docs" / "examples", tmp_path / "docs" / "examples")
    (tmp_path / "mine.toml").write_text(re.sub(r"^    ", "", example[0], flags=re.MULTILINE), encoding="utf-8")
    codes = {command: main(command.split()[1:]) for command in RUN_HERE}
    assert codes == RUN_HERE
    assert {path.name for path in (tmp_path / "pictures").iterdir()} >= {"housing.png", "response.png"}


def design_page() -> str:
    return (ROOT / "docs" / "design-file.md").read_text(encoding="utf-8")
