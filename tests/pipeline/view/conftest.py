"""Output folders to look at, each written once."""

import pytest
from browser import open_page, opened_browser  # noqa: F401 - fixtures
from view_stand_ins import write_output_folder

from twintip.cli import main


@pytest.fixture(scope="session")
def stand_in_folder(tmp_path_factory):
    """Return a stand-in for an output folder with fields; nobody writes into it."""
    return write_output_folder(tmp_path_factory.mktemp("view") / "out")


@pytest.fixture(scope="session")
def run_with_fields(tmp_path_factory):
    """Return the output folder of `pipeline run --fields`."""
    folder = tmp_path_factory.mktemp("fields") / "paper"
    assert main(["run", "--fields", "--out", str(folder)]) == 0  # all verdicts pass
    return folder
