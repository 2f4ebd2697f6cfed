"""Stored results say what found them, and how to find them again."""

import json
import re
from datetime import date

import pytest

from reference.stored import HERE

FILES = sorted(HERE.glob("*.json"))


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_provenance_is_whole(path):
    found = json.loads(path.read_text(encoding="utf-8"))
    assert set(found) == {"what", "program", "commit", "date", "versions", "again", "units", "results"}
    assert re.fullmatch("[0-9a-f]{40}", found["commit"])
    assert found["again"][0] == f"git checkout {found['commit']}"
    assert {"python", "numpy", "scipy", "scikit-fem"} <= set(found["versions"])
    assert date.fromisoformat(found["date"])
    assert not (HERE.parents[1] / found["program"]).exists()
