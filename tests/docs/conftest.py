"""The output folder that the documents are compared with."""

import os

import pytest

from twintip.cli import main


@pytest.fixture(autouse=True, scope="session")
def _work_here(kernel_here, curves_once):
    """Make solids in this process, and solve a force curve once."""


@pytest.fixture(scope="session")
def designed(tmp_path_factory):
    """Return the output folder of `pipeline design`."""
    folder = tmp_path_factory.mktemp("docs") / "paper"
    assert main(["design", "--out", os.fspath(folder)]) == 0
    return folder
