"""Solids from the cache are the files and findings of the run that made them; another design is made anew."""

import dataclasses
import hashlib

import pytest

import pipeline.stages.solids
from cad.design.parameters import Design
from cad.design.processes import PROCESSES
from cad.parts.layout import housing_for
from pipeline.stages.solids import write_solids
from pipeline.stages.springs import PrintedSpring, PrintedSprings

PETG = PROCESSES["fdm-petg"]
DEFLECTIONS = (0.5, 0.11)


@dataclasses.dataclass(frozen=True)
class Fitted:
    housing: object


def springs(lengths=(28.9, 14.8)):
    spring = PrintedSpring(name="low", target=1.0, printable=None)
    fitted = Fitted(housing_for(Design(), PETG, lengths, DEFLECTIONS))
    return PrintedSprings(low=spring, high=spring, process=PETG, deflections=DEFLECTIONS, fitted=fitted)


def digests(folder):
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in folder.iterdir()}


@pytest.fixture
def folders(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    for name in "ab":
        (tmp_path / name).mkdir()
    return tmp_path / "a", tmp_path / "b"


def test_second_time_gives_the_same_bytes_and_findings_without_a_solid(folders, monkeypatch):
    first, second = folders
    findings = write_solids(Design(), springs(), first)
    monkeypatch.setattr(pipeline.stages.solids, "write_sensor", lambda *_: pytest.fail("made again"))
    assert write_solids(Design(), springs(), second) == findings
    assert digests(first) == digests(second)
    assert {"housing.step", "housing.stl", "housing.3mf", "assembly.step"} == set(digests(first))


def test_another_leaf_is_another_solid(folders):
    first, second = folders
    write_solids(Design(), springs(), first)
    write_solids(Design(), springs((29.9, 14.8)), second)
    assert digests(first)["housing.step"] != digests(second)["housing.step"]


def test_another_name_is_another_mark(folders):
    first, second = folders
    write_solids(Design(), springs(), first)
    write_solids(Design(name="other"), springs(), second)
    assert digests(first)["housing.stl"] != digests(second)["housing.stl"]
