"""The examples of docs/python.md run as they stand, and the result has what the page says of it."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
OFFERED = re.search(r"\brun\b", (ROOT / "pipeline" / "__init__.py").read_text(encoding="utf-8"))
RUNS, FORMULAS = re.findall(r"^```python\n(.+?)^```", PAGE, flags=re.MULTILINE | re.DOTALL)


def attributes():
    """Return the attributes in the page's table."""
    return re.findall(r"^\| `(\w+)` \|", PAGE, flags=re.MULTILINE)


@pytest.mark.slow
@pytest.mark.usefixtures("without_page")
@pytest.mark.skipif(not OFFERED, reason="the package does not offer run() yet")
def test_example_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    exec(compile(RUNS, "docs/python.md", "exec"), names)
    printed = capsys.readouterr().out.splitlines()
    result = names["result"]
    assert printed[0] == "passed"
    (NL,) = (float(line.split()[1]) for line in printed if line.startswith("NL "))
    assert pytest.approx(0.06, abs=0.001) == NL
    assert len(attributes()) > 5
    assert [name for name in attributes() if not hasattr(result, name)] == []
    assert [path.name for path in (tmp_path / "outputs").iterdir()] == ["mine"]
    assert (tmp_path / "outputs" / "mine" / "report.json").is_file()


def test_formulas_run(capsys):
    exec(compile(FORMULAS, "docs/python.md", "exec"), {})
    assert float(capsys.readouterr().out.split()[-1]) == pytest.approx(2.0, rel=1e-12)
