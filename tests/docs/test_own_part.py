"""The example of docs/your-own-part.md runs as it stands."""

import re
from pathlib import Path

import pytest

PAGE = (Path(__file__).parents[2] / "docs" / "your-own-part.md").read_text(encoding="utf-8")


def test_example_runs(capsys):
    (example,) = re.findall(r"(?ms)^```python\n(.+?)^```", PAGE)
    exec(compile(example, "docs/your-own-part.md", "exec"), {})
    K, error = map(float, capsys.readouterr().out.split())
    assert pytest.approx(0.36, abs=0.01) == K
    assert error < 0.01
