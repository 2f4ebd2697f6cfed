"""Solids from the cache are the files and verdicts of the run that made them; another design is made anew."""

import hashlib
from concurrent.futures import Future
from types import SimpleNamespace

import pytest
import stand_ins
from stand_ins import GOOD, springs_of

import cad.checks.sensor_checks
import cad.fabrication.file_shapes
import cad.files.sensor_files
from pipeline.making.solids import SolidMaker
from pipeline.storage.kept_files import KeptFiles
from sensor.design.parameters import Design, Print

NO_FILES = SimpleNamespace(paths=(), forms=None)


def write_solids(design, springs, folder):
    """Return the verdicts of solids that are made and waited for in this process."""
    return SolidMaker(design, None).begin_files(springs.housing, springs.deflections).result().write_to(folder)


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
    monkeypatch.setattr(cad.files.sensor_files, "write_sensor", lambda *_: pytest.fail("made again"))
    verdicts = write_solids(Design(), springs_of(Design()), tmp_path)
    assert {"geometry.valid", "geometry.watertight"} <= {verdict.name for verdict in verdicts}
    assert [verdict.name for verdict in verdicts if not verdict.passed] == []
    assert digests(first) == digests(tmp_path)
    assert {"housing.step", "housing.stl", "housing.3mf", "assembly.step", "assembly.glb"} == set(digests(first))


@pytest.mark.usefixtures("first")
@pytest.mark.parametrize(
    ("design", "lengths"),
    [(Design(), (29.9, 14.8)), (Design(print=Print(E_MPa=1900.0)), stand_ins.LENGTHS)],
    ids=["another leaf", "another process"],
)
def test_another_leaf_or_process_is_made_anew(design, lengths, tmp_path, monkeypatch):
    """A check may be judged from any number of the process."""
    made = []
    monkeypatch.setattr(
        cad.files.sensor_files, "write_sensor", lambda sensor, *_: made.append(sensor.housing) or NO_FILES
    )
    monkeypatch.setattr(cad.checks.sensor_checks, "sensor_verdicts", lambda *_: ())
    monkeypatch.setattr(cad.fabrication.file_shapes, "files_as_designed", lambda *_: GOOD)
    springs = springs_of(Design(), lengths=lengths)
    write_solids(design, springs, tmp_path)
    assert made == [springs.housing]


class Worker:
    """Stands in for a worker: what is submitted waits in `waiting`, each a future and what it is to do."""

    def __init__(self):
        self.waiting = []

    def submit(self, *call):
        self.waiting.append((Future(), call))
        return self.waiting[-1][0]


def test_files_are_begun_once_and_those_of_a_housing_that_is_not_the_last_one_are_dropped(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    worker = Worker()
    maker = SolidMaker(Design(), worker)
    trial, last = (springs_of(Design(), lengths=lengths) for lengths in ((29.9, 14.8), (29.9, 14.9)))
    for springs in (trial, last):
        maker.begin_size(springs.housing, springs.deflections)
    (_, measured), (dropped, _), (_, measured_last), (kept, _) = worker.waiting
    assert (measured[1], measured_last[1]) == (trial.housing, last.housing)
    assert maker.begin_files(last.housing, last.deflections) is kept
    assert (dropped.cancelled(), kept.cancelled(), len(worker.waiting)) == (True, False, 4)
    assert maker.begin_files(None, last.deflections).result() == KeptFiles()
    assert kept.cancelled()


def test_no_housing_writes_no_file(tmp_path):
    assert write_solids(Design(), springs_of(Design(), made=False), tmp_path) == ()
    assert list(tmp_path.iterdir()) == []
