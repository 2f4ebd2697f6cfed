"""The output folder that the documents are compared with."""

import os
from pathlib import Path

import pytest

from pipeline.cli import main


@pytest.fixture(scope="session")
def designed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the output folder of `pipeline design`."""
    folder = tmp_path_factory.mktemp("docs") / "paper"
    assert main(["design", "--out", os.fspath(folder)]) == 0
    return folder
