"""The table of docs/measurements.md on large strain, row by row."""

from pathlib import Path

from reference.deep_press import accuracy_rows

ROOT = Path(__file__).parents[2]


def test_every_row_is_what_the_curves_give():
    page = (ROOT / "docs" / "measurements.md").read_text(encoding="utf-8")
    rows = list(accuracy_rows())
    assert len(rows) == 12
    assert [row for row in rows if row not in page] == []
