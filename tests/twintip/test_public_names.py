"""`import twintip`: every public name exists and is documented, and says what the commands say."""

import json
import re
from dataclasses import replace
from pathlib import Path

import cadquery as cq
import pytest
from stand_ins import relaxing_result, result_of

import pipeline
import twintip
from instrument.compress import modulus
from instrument.compress.force_law import POISSON, hertz_law
from instrument.press.printed_unit import unit_as_toml
from pipeline import study
from pipeline.report.of_result import report_of_result
from pipeline.report.outputs import write_outputs
from pipeline.storage.told import as_data
from sensor.quantity import STANDARD_GRAVITY
from twintip.cli import main

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
EXAMPLES = ROOT / "docs" / "examples"


@pytest.mark.parametrize("name", twintip.__all__)
def test_name_is_documented_where_it_is_defined_and_on_the_page(name):
    documented = getattr(twintip, name).__doc__
    assert documented is not None
    assert not documented.startswith(f"{name}(")  # which dataclasses write where nobody wrote a docstring
    assert re.search(rf"`twintip\.{name}\b", PAGE)


def test_page_and_editors_know_all_names_and_no_others():
    names = {*twintip.__all__, "__version__"}
    assert set(re.findall(r"\btwintip\.(\w+)", PAGE)) == names == set(dir(twintip))
    assert sorted(twintip.__all__) == twintip.__all__
    with pytest.raises(AttributeError, match="springs_of"):
        _ = twintip.springs_of


def test_names_are_those_of_the_pipeline():
    for room, names in ((pipeline, pipeline.__all__), (study, set(study.__all__) - {"Engine"})):
        for name in names:
            assert getattr(twintip, name) is getattr(room, name)


TAGS = {
    "housing": {"low_tip", "high_tip", "mounting_holes", "side_faces"},
    "cover": {"rim", "mounting_holes"},
    "mount": {"seat", "flange", "mounting_holes", "flange_holes"},
}


@pytest.mark.parametrize("name", [*TAGS, "assembly"])
def test_solids_of_a_housing_that_is_not_made_are_refused(name):
    with pytest.raises(twintip.InputError) as raised:
        getattr(twintip, name)(result_of(made=False))
    assert raised.value.field == "housing"


def test_parts_are_solids_whose_named_faces_are_tags():
    """The bracket stands behind the cover, and its flange lies above the frame by the room for heads of M6."""
    result = result_of()
    parts = {name: getattr(twintip, name)(result) for name in TAGS}
    assert {name: set(part.ctx.tags) for name, part in parts.items()} == TAGS
    assert [part.solids().size() for part in parts.values()] == [1, 1, 1]
    frame = result.springs.housing
    back = parts["cover"].val().BoundingBox().ymax
    assert parts["mount"].faces(tag="seat").val().Center().y == pytest.approx(back, abs=1e-9)
    assert parts["mount"].faces(tag="flange").val().Center().z == pytest.approx(frame.top_level + 8.0 + 5.0, abs=1e-9)
    for name in TAGS:
        assert parts[name].faces(tag="mounting_holes").size() == len(frame.holes)


def test_assembly_has_the_parts_of_the_file_and_takes_constraints_on_their_tags():
    """A plate is put on the front cover by its rim, without a name that CadQuery cannot read."""
    result = result_of()
    assembly = twintip.assembly(result)
    names = [part.name for part in assembly.children]
    assert {"housing", "front_cover", "back_cover", "screw_1", "fruit"} <= set(names)
    assert len(set(names)) == len(names)
    depth = result.springs.housing.depth
    for name, y in (("front_cover", -0.5 * depth), ("back_cover", 0.5 * depth)):
        cover = assembly.objects[name]
        assert cover.obj.faces(tag="rim").val().moved(cover.loc).Center().y == pytest.approx(y, abs=1e-9)
    plate = cq.Workplane().box(5.0, 5.0, 1.0)
    plate.faces("<Z").tag("under")
    assembly.add(plate, name="plate").constrain("housing", "Fixed")
    assembly.constrain("housing?low_tip", "plate?under", "Plane").solve()
    assert assembly.objects["plate"].loc.toTuple()[0][2] == pytest.approx(-0.5, abs=1e-5)  # its middle, of casadi


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return the output folder of a pair."""
    out = tmp_path_factory.mktemp("pair") / "out"
    out.mkdir()
    write_outputs(result_of(), out)
    return out


STIFFNESS = {"low": 0.9, "high": 20.0}  # [N/mm] of the printed springs


@pytest.fixture(scope="module")
def weights(tmp_path_factory):
    """Return a table of weights of up to 100 g on springs of these stiffnesses."""
    rows = ["tip,weight_g,deflection_mm"]
    for tip, K in STIFFNESS.items():
        rows += [f"{tip},{grams},{STANDARD_GRAVITY * 1e-3 * grams / K}" for grams in (0, 20, 50, 100)]
    path = tmp_path_factory.mktemp("weights") / "weights.csv"
    path.write_text("\n".join(rows), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def press(tmp_path_factory):
    """Return two presses of a pair: forces that rise with the travel, and a sensor lifted between."""
    depths = 2 * [0.03 * step for step in range(21)]
    rows = [f"{0.02 * number},{x},{0.686 * x},{1.79 * x}" for number, x in enumerate(depths)]
    path = tmp_path_factory.mktemp("press") / "press.csv"
    path.write_text("\n".join(["t_s,x_mm,F_l_N,F_h_N", *rows, ""]), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def unit(folder, weights, tmp_path_factory):
    """Return the unit that the command calibrates by the weights."""
    path = tmp_path_factory.mktemp("unit") / "unit.toml"
    assert main(["calibrate", str(folder), str(weights), "--out", str(path), "--after", "60"]) in (0, 1)
    return path


@pytest.mark.parametrize("calibrated", [False, True])
def test_presses_of_a_pair_are_read_as_by_the_command(calibrated, folder, press, unit, capsys):
    readings = twintip.read_press(twintip.read_report(folder), press, *[unit] * calibrated)
    capsys.readouterr()
    assert main(["read", str(folder), str(press), "--json", *["--unit", str(unit)] * calibrated]) == 0
    printed = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [as_data(reading) for reading in readings] == printed
    assert len(readings) == 2


def test_unit_is_calibrated_and_written_as_firmware_as_by_the_commands(folder, weights, press, unit, tmp_path):
    header, module = tmp_path / "sensor.h", tmp_path / "sensor.py"
    written = ["--unit", str(unit), "--c-header", str(header), "--micropython", str(module)]
    assert main(["read", str(folder), *written]) == 0
    report = twintip.read_report(folder)
    calibrated = twintip.calibrate(report, weights, after_s=60.0).unit
    assert calibrated.K_N_per_m == pytest.approx([1e3 * K for K in STIFFNESS.values()], rel=1e-9)
    assert unit_as_toml(calibrated) == unit.read_text(encoding="utf-8")
    for of_unit in (unit, calibrated):
        assert twintip.c_header(report, of_unit) == header.read_text(encoding="utf-8")
        assert twintip.micropython(report, of_unit) == module.read_text(encoding="utf-8")
    assert twintip.read_press(report, press, calibrated) == twintip.read_press(report, press, unit)


def test_how_counts_are_written_is_handed_on(folder, weights, press, monkeypatch):
    report = twintip.read_report(folder)
    with pytest.raises(twintip.InputError) as raised:
        twintip.calibrate(report, weights, counts_as="unsigned")  # a table without counts
    assert raised.value.field == "--counts-as"
    monkeypatch.setattr("instrument.press.presses.readings_of", lambda *_, counts_as: [counts_as])
    assert twintip.read_press(report, press, counts_as="offset") == ["offset"]


def test_what_no_unit_can_be_is_refused(folder, weights):
    report = twintip.read_report(folder)
    calibrated = twintip.calibrate(report, weights).unit
    for field, refused in (
        ("after_s", lambda: twintip.calibrate(report, weights, after_s=-1.0)),
        ("unit.design", lambda: twintip.c_header(report, replace(calibrated, design_sha256="0" * 64))),
        ("fruit.relaxation", lambda: twintip.micropython(report_of_result(relaxing_result()))),
    ):
        with pytest.raises(twintip.InputError) as raised:
            refused()
        assert raised.value.field == field


def of_hertz(test, _count):
    law = hertz_law(test)
    return replace(law, others={POISSON: [law]})


def test_compression_test_is_evaluated_as_by_the_command(capsys, monkeypatch):
    """By Hertz's law for both: tests of the compression solve the force of the body."""
    monkeypatch.setattr(modulus, "solved_law", of_hertz)
    file = EXAMPLES / "fruit-1.csv"
    body = twintip.Ellipsoid(height_mm=70.0, radius_mm=35.0, radius_across_mm=35.0)
    results = twintip.modulus(file, twintip.TestGeometry(body=body))
    assert main(["modulus", str(file), "--height", "70", "--radius", "35", "--json"]) == 0
    by_command = json.loads(capsys.readouterr().out)
    numbers = [json.loads(json.dumps(as_data(result))) for result in results]
    assert [{**row, "notes": None} for row in numbers] == [{**row, "notes": None} for row in by_command]
