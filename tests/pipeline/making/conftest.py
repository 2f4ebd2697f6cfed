"""The fields of the default design, written once."""

import dataclasses

import pytest

from pipeline.making.field_files import write_fields


@pytest.fixture(scope="session")
def fields_folder(default_run, tmp_path_factory):
    """Return a folder with the files that `--fields` adds to the default run; nobody writes into it."""
    folder = tmp_path_factory.mktemp("fields")
    result = default_run.result
    options = dataclasses.replace(result.options, fields=True)
    assert write_fields(result.pressed, result.press, options, folder) == ()
    return folder
