"""The docstring of each public name: its form, what it says of the signature, and its example."""

import dataclasses
import doctest
import inspect
import shutil
from pathlib import Path

import pytest
from example_files import write_example_files
from stand_ins import result_of

import twintip
from docs.docstrings import GROUPS, docstring, signature
from pipeline import main_job

ROOT = Path(__file__).parents[2]
FUNCTIONS = [name for name in twintip.__all__ if inspect.isfunction(getattr(twintip, name))]
SLOW = {"modulus", "CompressionResult"}  # a fruit is solved
SLOW |= {"process_engine", "run_study", "StudySummary"}  # processes are started
STUDY = """
base = "paper"
how = "grid"
wanted = ["springs.K_l_N_per_m"]
[vary]
"targets.P_max" = [4, 5, 6, 7]
"""


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Return a folder with the files that examples name: a run of a pair, a press, weights, a test and a study."""
    folder = tmp_path_factory.mktemp("files")
    write_example_files(folder)
    (folder / "springs.toml").write_text(STUDY, encoding="utf-8")
    shutil.copy(ROOT / "docs" / "examples" / "fruit-1.csv", folder)
    return folder


@pytest.fixture
def folder(files, tmp_path, monkeypatch):
    """Work in a copy of that folder."""
    shutil.copytree(files, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)


def complaints(name):
    """Return what differs from the docstring where the examples of a name are run, and how many there are."""
    example = doctest.DocTestParser().get_doctest(
        inspect.getdoc(getattr(twintip, name)) or "", {"twintip": twintip, "Path": Path}, name, None, None
    )
    told = []
    doctest.DocTestRunner(verbose=False).run(example, out=told.append)
    return told, len(example.examples)


def entry_names(parts, title):
    """Return the names in a section of a docstring; an entry may have several."""
    return [name for entry in parts.sections.get(title, ()) for name in entry.name.split(", ")]


def test_groups_of_the_page_have_every_public_name_once():
    assert sorted(name for names in GROUPS.values() for name in names) == twintip.__all__


@pytest.mark.parametrize("name", [name for name in twintip.__all__ if signature(name)])
def test_docstring_of_what_is_called_has_its_parameters_and_result(name):
    parts = docstring(name)
    called = inspect.signature(getattr(twintip, name))
    assert entry_names(parts, "Parameters") == list(called.parameters)
    optional = {each.name for each in called.parameters.values() if each.default is not inspect.Parameter.empty}
    assert {entry.name for entry in parts.sections["Parameters"] if entry.kind.endswith(", optional")} == optional
    assert all(entry.kind for entry in parts.sections["Parameters"])
    results = {"Returns", "Yields"} & parts.sections.keys()
    assert results == ({"Yields" if name == "process_engine" else "Returns"} if name in FUNCTIONS else set())


@pytest.mark.parametrize("name", sorted({*twintip.__all__} - {*FUNCTIONS} - {"InputError"}))
def test_docstring_of_a_record_has_its_fields_and_units(name):
    """Each attribute is a field or a property, and each field is an attribute or a parameter, or one of its base."""
    kind, parts = getattr(twintip, name), docstring(name)
    named = entry_names(parts, "Attributes") + entry_names(parts, "Parameters")
    own = [item.name for item in dataclasses.fields(kind)]
    assert [each for each in named if each not in own and not hasattr(kind, each)] == []
    assert [each for each in own if each not in named] == []
    scaled = [item for item in dataclasses.fields(kind) if "times" in item.metadata]
    assert [item.name for item in scaled if "attribute_unit" not in item.metadata] == []


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow if name in SLOW else ()) for name in twintip.__all__]
)
@pytest.mark.usefixtures("folder", "without_page")
def test_example_of_a_docstring_runs(name, monkeypatch):
    """On stand-ins of a solved sensor: what is solved is tested elsewhere."""
    monkeypatch.setattr(main_job, "evaluated", lambda _: result_of())
    told, count = complaints(name)
    assert count
    assert told == []


@pytest.mark.slow
@pytest.mark.parametrize("name", ["run", "evaluate", "assembly"])
@pytest.mark.usefixtures("folder")
def test_example_of_a_docstring_runs_where_all_is_solved(name):
    assert complaints(name)[0] == []
