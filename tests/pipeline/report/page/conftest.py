"""Pages of results that were not solved, and of the default run."""

import functools
from dataclasses import dataclass
from pathlib import Path

import pytest
from browser import open_page, opened_browser  # noqa: F401 - fixtures
from stand_ins import result_of

from pipeline.main_job import run
from pipeline.options import RunOptions
from pipeline.report.outputs import PAGE, write_outputs
from pipeline.report.report import Report, read_report
from pipeline.result import SensorResult
from sensor.design.fruit import Fruit
from sensor.design.parameters import Design
from sensor.design.tips import Tips

DOMES = Design(
    name="domes",
    fruit=Fruit(shape="sphere", radius_mm=35.0, thickness_mm=12.0),
    tips=Tips(shape="dome", dome_radius_mm=10.0, side_mm=5.6),
)
"""A pair of domes on a sphere: its response is no linear one."""


@dataclass(frozen=True, kw_only=True)
class WrittenPage:
    """The page of a result, its folder, and the report that it was made of."""

    result: SensorResult
    folder: Path
    report: Report
    text: str

    @property
    def address(self):
        """Return the address by which a browser opens the page."""
        return (self.folder / PAGE).as_uri()


def written(result, folder):
    write_outputs(result, folder, page=True)
    text = (folder / PAGE).read_text(encoding="utf-8")
    return WrittenPage(result=result, folder=folder, report=read_report(folder), text=text)


@pytest.fixture(scope="session")
def flat_page(tmp_path_factory):
    """Return the page of the paper's scene, whose forces follow from the compliance."""
    return written(result_of(), tmp_path_factory.mktemp("page"))


@pytest.fixture(scope="session")
def dome_page(tmp_path_factory):
    """Return the page of a scene that is not linear."""
    return written(result_of(DOMES), tmp_path_factory.mktemp("page"))


@pytest.fixture
def written_page():
    """Return the function that writes a result into a folder and returns its page."""
    return written


@pytest.fixture(scope="session")
def preset_page(tmp_path_factory):
    """Return a function that looks at a design, each once, and returns its page; nobody writes into its folder.

    What a page says of a result is compared with that result: how finely it was solved does not count.
    """

    @functools.cache
    def written_run(design):
        folder = tmp_path_factory.mktemp("preset") / "out"
        result = run(design, RunOptions(out=folder, look=True, tolerance=0.02))
        text = (folder / PAGE).read_text(encoding="utf-8")
        return WrittenPage(result=result, folder=folder, report=read_report(folder), text=text)

    return written_run
