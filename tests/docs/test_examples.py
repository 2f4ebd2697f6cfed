"""The scripts in examples run, use public names alone, and print what docs/python.md shows."""

import re
import runpy
from pathlib import Path

import pytest
from marks import cases_by_time
from scripts import loaded_script

import twintip

ROOT = Path(__file__).parents[2]
GALLERY = loaded_script(ROOT / "docs" / "gallery.py")
QUICK = ("two_spring_law",)
STUDIES = ("own_housing",)  # two parts of its own are meshed and solved: 30 s
OWN_PACKAGES = {"sensor", "cad", "mesh", "solve", "pipeline", "instrument", "reference", "tests"}


@pytest.mark.slow
def test_editor_that_gives_show_object_is_shown_the_assembly(tmp_path, monkeypatch):
    """As CQ-editor does."""
    monkeypatch.chdir(tmp_path)
    shown = []
    given = {"show_object": lambda assembly, name: shown.append((name, [part.name for part in assembly.children]))}
    runpy.run_path(str(GALLERY.EXAMPLES / "cut_into_an_assembly.py"), init_globals=given)
    ((name, parts),) = shown
    assert name == "sensor"
    assert {"housing", "front_cover", "mount", "arm"} <= set(parts)


def test_gallery_has_every_example():
    assert sorted(GALLERY.ORDER) == sorted(path.stem for path in (ROOT / "examples").glob("*.py"))
    _, _, gallery = GALLERY.PAGE.read_text(encoding="utf-8").partition(GALLERY.MARK)
    assert len(re.findall("^##+ ", gallery, flags=re.MULTILINE)) == len(GALLERY.ORDER) > 10


@pytest.mark.parametrize("name", GALLERY.ORDER)
def test_example_uses_public_names_alone(name):
    text = (ROOT / "examples" / f"{name}.py").read_text(encoding="utf-8")
    imported = re.findall(r"^ *(?:from|import) (\w+)", text, flags=re.MULTILINE)
    assert OWN_PACKAGES.isdisjoint(imported)
    assert set(re.findall(r"\btwintip\.(\w+)", text)) <= set(twintip.__all__)


@pytest.mark.parametrize("name", cases_by_time(GALLERY.ORDER, slow={*GALLERY.ORDER} - {*QUICK}, studies=STUDIES))
def test_example_prints_what_the_page_shows(name, tmp_path, monkeypatch, capsys):
    """The numbers have few digits, so that round-off of another machine does not show.

    The quick one runs in a process of its own, as the gallery itself runs all. The others share what is loaded.
    """
    shown = GALLERY.PAGE.read_text(encoding="utf-8")
    if name in QUICK:
        printed = GALLERY.run_example(name, tmp_path)
    else:
        monkeypatch.chdir(tmp_path)
        runpy.run_path(str(GALLERY.EXAMPLES / f"{name}.py"), run_name="__main__")
        printed = capsys.readouterr().out
    assert GALLERY.section(name, printed) in shown
    if name in GALLERY.PICTURES:
        assert (tmp_path / "outputs" / GALLERY.PICTURES[name]).stat().st_size > 0
