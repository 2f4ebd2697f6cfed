"""docs/modulus.md: its example makes the committed files, and its commands give the answer that it shows."""

import re
from pathlib import Path

import numpy as np
import pytest

from pipeline.cli import main

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "modulus.md").read_text(encoding="utf-8")
EXAMPLES = ROOT / "docs" / "examples"


def numbers(path: Path) -> np.ndarray:
    return np.loadtxt(path, delimiter=",", skiprows=1)


def test_example_makes_the_files_of_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """They have five digits; another machine may round the last one the other way."""
    (example,) = re.findall(r"^```python\n(.+?)^```", PAGE, flags=re.MULTILINE | re.DOTALL)
    monkeypatch.chdir(tmp_path)
    exec(compile(example, "docs/modulus.md", "exec"), {})
    made = sorted(tmp_path.iterdir())
    assert [path.name for path in made] == ["fruit-1.csv", "fruit-2.csv", "fruit-3.csv"]
    for path in made:
        np.testing.assert_allclose(numbers(path), numbers(EXAMPLES / path.name), rtol=0.0, atol=1.5e-5)


def test_range_on_the_page_is_what_the_command_prints(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(ROOT)
    command = next(line for line in PAGE.splitlines() if line.startswith("    pipeline modulus"))
    assert main(command.split()[1:]) == 0
    shown = re.findall(r"^    (\[fruit\]|E_\w+ = .+)$", PAGE, flags=re.MULTILINE)
    assert len(shown) == 3
    assert set(shown) <= set(capsys.readouterr().out.splitlines())
