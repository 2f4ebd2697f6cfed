"""Every command that the README and the documents show is known to the command line; those of RUN_HERE are run."""

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


def commands(text: str) -> set[str]:
    """Return the commands that a text shows in indented lines, in shell blocks and in its sentences."""
    fenced = (line for block in FENCE.findall(text) for line in block.splitlines())
    shown = [*LINE.findall(text), *INLINE.findall(text), *LINE.findall("\n".join(f"    {line}" for line in fenced))]
    return {re.split(r"\s+#", command)[0].strip() for command in shown}


def shown() -> list[str]:
    return sorted(set().union(*(commands(page.read_text(encoding="utf-8")) for page in PAGES)))


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
