"""Solids from the cache are the files and verdicts of the run that made them; another design is made anew."""

import hashlib

import pytest
from stand_ins import springs_of

import pipeline.stages.solids
from cad.design.parameters import Design
from pipeline.stages.solids import write_solids


def digests(folder):
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in folder.iterdir()}


@pytest.fixture(scope="module")
def first(tmp_path_factory):
    """Return the folder of the default design's solids; they are in a cache of this module."""
    place = tmp_path_factory.mktemp("solids")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(place / "cache"))
        (place / "first").mkdir()
        write_solids(Design(), springs_of(Design()), place / "first")
        yield place / "first"


def test_second_time_gives_the_same_bytes_and_verdicts_without_a_solid(first, tmp_path, monkeypatch):
    monkeypatch.setattr(pipeline.stages.solids, "write_sensor", lambda *_: pytest.fail("made again"))
    verdicts = write_solids(Design(), springs_of(Design()), tmp_path)
    assert {"geometry.valid", "geometry.watertight"} <= {verdict.name for verdict in verdicts}
    assert [verdict.name for verdict in verdicts if not verdict.passed] == []
    assert digests(first) == digests(tmp_path)
    assert {"housing.step", "housing.stl", "housing.3mf", "assembly.step"} == set(digests(first))


def test_another_leaf_is_another_solid(first, tmp_path):
    write_solids(Design(), springs_of(Design(), lengths=(29.9, 14.8)), tmp_path)
    assert digests(first)["housing.step"] != digests(tmp_path)["housing.step"]


def test_another_name_is_another_mark(first, tmp_path):
    write_solids(Design(name="other"), springs_of(Design()), tmp_path)
    assert digests(first)["housing.stl"] != digests(tmp_path)["housing.stl"]


def test_no_housing_writes_no_file(tmp_path):
    assert write_solids(Design(), springs_of(Design(), made=False), tmp_path) == ()
    assert list(tmp_path.iterdir()) == []
