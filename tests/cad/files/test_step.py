import math

import cadquery as cq
import pytest

from cad.files.step import read_step, write_step
from cad.parts.sensor import NamedSolid

BOX = NamedSolid(name="box", shape=cq.Solid.makeBox(1, 2, 3), colour=(1, 0, 0))
DOME = NamedSolid(name="dome", shape=cq.Solid.makeSphere(1), colour=(0, 1, 0.5))


def test_names_colours_and_volume_come_back(tmp_path):
    write_step((BOX, DOME), tmp_path / "two.step", "pair")
    assembly = cq.Assembly.importStep(str(tmp_path / "two.step"))
    assert assembly.name == "pair"
    colours = {child.name: child.color.toTuple()[:3] for child in assembly.children}
    assert set(colours) == {"box", "dome"}
    assert colours["box"] == pytest.approx(BOX.colour, abs=1e-6)
    assert colours["dome"] == pytest.approx(DOME.colour, abs=1e-6)
    volume = read_step(tmp_path / "two.step").Volume()
    assert volume == pytest.approx(6.0 + 2.0 / 3.0 * math.pi, rel=1e-9)


def test_header_holds_the_given_time_and_millimetres(tmp_path, monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")
    write_step([BOX], tmp_path / "one.step", "box")
    text = (tmp_path / "one.step").read_text()
    assert "'1970-01-02T00:00:00'" in text
    assert "AP242_MANAGED_MODEL_BASED_3D_ENGINEERING" in text
    assert "SI_UNIT(.MILLI.,.METRE.)" in text


def test_missing_folder_and_text_that_is_no_step_are_refused(tmp_path):
    with pytest.raises(OSError, match=r"none/a\.step"):
        write_step([BOX], tmp_path / "none" / "a.step", "box")
    (tmp_path / "a.step").write_text("hello")
    with pytest.raises(ValueError, match=r"a\.step"):
        read_step(tmp_path / "a.step")
