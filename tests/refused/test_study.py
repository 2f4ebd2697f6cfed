"""Study files that are refused, row by row of study.toml, each in one line before a point is drawn."""

import tomllib
from pathlib import Path

import pytest

from pipeline.study import read_study
from pipeline.study.points import point_count
from pipeline.study.wanted import level_of
from sensor.quantity import InputError

TABLE = tomllib.loads(Path(__file__).with_name("study.toml").read_text(encoding="utf-8"))


@pytest.fixture
def refusal_of(tmp_path, monkeypatch):
    """Return a function from the text of a study file to the error that refuses it."""
    monkeypatch.chdir(tmp_path)

    def refused(text):
        Path("study.toml").write_text(text, encoding="utf-8")
        with pytest.raises(InputError) as error:
            point_count(read_study(Path("study.toml")))
        assert "\n" not in str(error.value)
        return error.value

    return refused


@pytest.mark.parametrize("row", TABLE["rows"], ids=lambda row: f"{row[0]} -> {row[1]}")
def test_study_file_is_refused(row, refusal_of):
    old, new, field, *value = row
    assert old in TABLE["file"]
    error = refusal_of(TABLE["file"].replace(old, new))
    given = [list(error.value) if isinstance(error.value, tuple) else error.value]
    assert (error.field, given) == (field, value or [None])


@pytest.mark.parametrize(("points", "field"), [*TABLE["points"], (None, "FILE")])
def test_file_of_points_is_refused(points, field, refusal_of):
    if points is not None:
        Path("some.csv").write_text(points, encoding="utf-8")
    assert refusal_of('points = "some.csv"\nwanted = ["springs.K_l_N_per_m"]\n').field == field


@pytest.mark.parametrize("key", TABLE["keys"])
def test_key_that_no_report_has_is_refused(key):
    with pytest.raises(InputError) as refused:
        level_of("optimise.minimise", ["passed", key])
    assert (refused.value.field, refused.value.value) == ("optimise.minimise", key)
