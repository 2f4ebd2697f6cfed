import codecs
import math
import re
import subprocess
import sys
from pathlib import Path

import cadquery as cq
import OCP
import pytest

from cad.files import step
from cad.files.step import read_step, write_step
from sensor.machine_error import MachineError

BOX = cq.Assembly(cq.Solid.makeBox(1, 2, 3), name="box", color=cq.Color(1, 0, 0))
DOME = cq.Assembly(cq.Solid.makeSphere(1), name="dome", color=cq.Color(0, 1, 0.5))


def assemble_sensor(name, *parts):
    assembly = cq.Assembly(name=name)
    for part in parts:
        assembly.add(part)
    return assembly


def test_names_colours_and_volume_come_back(tmp_path):
    write_step(assemble_sensor("pair", BOX, DOME), tmp_path / "two.step")
    assembly = cq.Assembly.importStep(str(tmp_path / "two.step"))
    assert assembly.name == "pair"
    colours = {child.name: child.color.toTuple()[:3] for child in assembly.children}
    assert set(colours) == {"box", "dome"}
    assert colours["box"] == pytest.approx((1.0, 0.0, 0.0), abs=1e-6)
    assert colours["dome"] == pytest.approx((0.0, 1.0, 0.5), abs=1e-6)
    volume = read_step(tmp_path / "two.step").Volume()
    assert volume == pytest.approx(6.0 + 2.0 / 3.0 * math.pi, rel=1e-9)


def test_header_holds_the_given_time_and_millimetres(tmp_path, monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")
    write_step(BOX, tmp_path / "one.step")
    text = (tmp_path / "one.step").read_text()
    assert "'1970-01-02T00:00:00'" in text
    assert "AP242_MANAGED_MODEL_BASED_3D_ENGINEERING" in text
    assert "SI_UNIT(.MILLI.,.METRE.)" in text
    assert "INCH" not in text  # whose unit is so many of these


def test_first_file_of_a_process_is_ap242_too(tmp_path):
    """The kernel's settings exist only once one of its controllers has been made."""
    program = """if True:
        import sys
        from pathlib import Path
        import cadquery as cq
        from cad.files.step import write_step
        write_step(cq.Assembly(cq.Solid.makeBox(1, 2, 3), name="box"), Path(sys.argv[1]))
    """
    subprocess.run([sys.executable, "-c", program, tmp_path / "first.step"], check=True, cwd=Path(__file__).parents[3])
    assert "AP242_MANAGED_MODEL_BASED_3D_ENGINEERING" in (tmp_path / "first.step").read_text()


def test_settings_of_the_process_neither_count_nor_change(tmp_path):
    """A program that has set metres for its own files gets ours in millimetres, and keeps its metres."""
    given = {"write.step.schema": "AP203", "write.step.unit": "M", "xstep.cascade.unit": "M"}
    settings = OCP.Interface.Interface_Static
    OCP.STEPControl.STEPControl_Controller.Init_s()
    before = {key: settings.CVal_s(key) for key in given}
    try:
        assert all(settings.SetCVal_s(key, value) for key, value in given.items())
        write_step(BOX, tmp_path / "box.step")
        volume = read_step(tmp_path / "box.step").Volume()
        assert {key: settings.CVal_s(key) for key in given} == given
    finally:
        assert all(settings.SetCVal_s(key, value) for key, value in before.items())
    text = (tmp_path / "box.step").read_text()
    assert "AP242_MANAGED_MODEL_BASED_3D_ENGINEERING" in text
    assert "SI_UNIT(.MILLI.,.METRE.)" in text
    assert volume == pytest.approx(6.0)


@pytest.mark.parametrize("setting", [("write.step.schema", "AP999"), ("write.step.colour", "red")])
def test_setting_that_the_kernel_does_not_take_is_an_error(tmp_path, monkeypatch, setting):
    monkeypatch.setattr(step, "_WRITING", dict([setting]))
    with pytest.raises(MachineError, match=setting[0]):
        write_step(BOX, tmp_path / "box.step")


def test_byte_order_mark_is_passed_over(tmp_path):
    """With the line ends of Windows, as some translators write."""
    write_step(BOX, tmp_path / "box.step")
    content = (tmp_path / "box.step").read_bytes().replace(b"\n", b"\r\n")
    (tmp_path / "marked.step").write_bytes(codecs.BOM_UTF8 + content)
    assert read_step(tmp_path / "marked.step").Volume() == pytest.approx(6.0)


def test_missing_folder_and_text_that_is_no_step_are_refused(tmp_path):
    with pytest.raises(OSError, match=r"none/a\.step"):
        write_step(BOX, tmp_path / "none" / "a.step")
    (tmp_path / "a.step").write_text("hello")
    with pytest.raises(ValueError, match=r"a\.step"):
        read_step(tmp_path / "a.step")


def test_part_that_was_moved_stays_there_with_its_name(tmp_path):
    """OCCT writes it as an instance of the part as it was drawn."""
    moved = BOX.obj.moved(cq.Location(cq.Vector(5.0, 0.0, 0.0)))
    write_step(cq.Assembly(moved, name="box"), tmp_path / "moved.step")
    assert read_step(tmp_path / "moved.step").Center().toTuple() == pytest.approx((5.5, 1.0, 1.5))
    text = re.sub(r"\s+", "", (tmp_path / "moved.step").read_text())
    assert re.findall(r"=NEXT_ASSEMBLY_USAGE_OCCURRENCE\('[^']*','([^']*)'", text) == ["box"]


def test_equal_bodies_are_instances_of_one_product(tmp_path):
    """One product for each shape, one use of it for each body: AP242, product and next_assembly_usage_occurrence."""
    washers = [
        cq.Assembly(BOX.obj, name=name, loc=cq.Location(cq.Vector(0, 5.0 * number, 0)), color=BOX.color)
        for number, name in enumerate(("front_washer_1", "back_washer_1", "back_washer_2"))
    ]
    write_step(assemble_sensor("many", DOME, *washers), tmp_path / "many.step")
    text = re.sub(r"\s+", "", (tmp_path / "many.step").read_text())
    assert sorted(re.findall(r"=PRODUCT\('([^']*)'", text)) == ["dome", "many", "washer"]
    uses = re.findall(r"=NEXT_ASSEMBLY_USAGE_OCCURRENCE\('[^']*','([^']*)'", text)
    assert sorted(uses) == sorted(["dome", *(washer.name for washer in washers)])


@pytest.mark.parametrize("drawn", [0, 1, 2])
def test_instance_that_lies_as_it_was_drawn_has_its_name_too(tmp_path, drawn):
    """By its place: OCCT gave its name to another one, and left it without any."""
    boxes = [
        cq.Assembly(BOX.obj, name=f"box_{number}", loc=cq.Location(cq.Vector(10.0 * (number - drawn), 0.0, 0.0)))
        for number in range(3)
    ]
    write_step(assemble_sensor("many", DOME, *boxes), tmp_path / "many.step")
    children = cq.Assembly.importStep(str(tmp_path / "many.step")).children
    places = {child.name: child.toCompound().Center().x for child in children}
    expected = {box.name: 0.5 + 10.0 * (number - drawn) for number, box in enumerate(boxes)}
    assert places == pytest.approx({"dome": 0.0, **expected}, abs=1e-9)
