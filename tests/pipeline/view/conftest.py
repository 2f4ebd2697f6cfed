"""Output folders to look at, each written once."""

import pytest
from browser import open_page, opened_browser  # noqa: F401 - fixtures
from view_stand_ins import write_output_folder


@pytest.fixture(scope="session")
def stand_in_folder(tmp_path_factory):
    """Return a stand-in for an output folder with fields; nobody writes into it."""
    return write_output_folder(tmp_path_factory.mktemp("view") / "out")
