"""`import twintip`: every public name exists and is documented, and says what the commands say."""

import json
import re
from dataclasses import replace
from pathlib import Path

import cadquery as cq
import numpy as np
import pytest
from example_files import STIFFNESS, write_example_files
from stand_ins import relaxing_result, result_of

import pipeline
import twintip
from instrument.press.printed_unit import unit_as_toml
from pipeline import study
from pipeline.report.of_result import report_of_result
from pipeline.storage.record_data import as_data
from twintip.cli import main

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")


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
    frame = result.springs.housing
    for name, part in parts.items():
        assert part.solids().size() == 1
        assert part.faces(tag="mounting_holes").size() == len(frame.holes), name
    back = parts["cover"].val().BoundingBox().ymax
    seat, flange = (parts["mount"].faces(tag=tag).val().Center() for tag in ("seat", "flange"))
    assert (seat.y, flange.z) == pytest.approx((back, frame.top_level + 8.0 + 5.0), abs=1e-9)


def test_assembly_has_the_parts_of_the_file_and_takes_constraints_on_their_tags():
    result = result_of()
    assembly = twintip.assembly(result)
    names = [part.name for part in assembly.children]
    assert {"housing", "front_cover", "back_cover", "screw_1", "fruit"} <= set(names)
    plate = cq.Workplane().box(5.0, 5.0, 1.0)
    plate.faces("<Z").tag("under")
    assembly.add(plate, name="plate").constrain("housing", "Fixed")
    assembly.constrain("housing?low_tip", "plate?under", "Plane").solve()
    assert assembly.objects["plate"].loc.toTuple()[0][2] == pytest.approx(-0.5, abs=1e-5)  # its middle, of casadi


@pytest.fixture(scope="module")
def example(tmp_path_factory):
    """Return the folder of the files that examples name."""
    folder = tmp_path_factory.mktemp("example")
    write_example_files(folder)
    return folder


@pytest.fixture(scope="module")
def folder(example):
    """Return the output folder of a pair."""
    return example / "outputs" / "mine"


@pytest.fixture(scope="module")
def weights(example):
    return example / "weights.csv"


@pytest.fixture(scope="module")
def press(example):
    return example / "press.csv"


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
    assert readings


def test_unit_is_calibrated_and_written_as_firmware_as_by_the_commands(folder, weights, press, unit, tmp_path):
    header, module = tmp_path / "sensor.h", tmp_path / "sensor.py"
    written = ["--unit", str(unit), "--c-header", str(header), "--micropython", str(module)]
    assert main(["read", str(folder), *written]) == 0
    report = twintip.read_report(folder)
    calibrated = twintip.calibrate(report, weights, after_s=np.float32(60.0)).unit
    assert calibrated.K_N_per_m == pytest.approx([1e3 * K for K in STIFFNESS.values()], rel=1e-9)
    assert unit_as_toml(calibrated) == unit.read_text(encoding="utf-8")
    for of_unit in (unit, calibrated):
        assert twintip.c_header(report, of_unit) == header.read_text(encoding="utf-8")
        assert twintip.micropython(report, of_unit) == module.read_text(encoding="utf-8")
    assert twintip.read_press(report, press, calibrated) == twintip.read_press(report, press, unit)


def test_study_is_read_from_a_path_of_either_type(tmp_path):
    path = tmp_path / "study.toml"
    text = 'base = "paper"\nsamples = 2\nwanted = ["springs.K_l_N_per_m"]\n[vary]\n"targets.P_max" = [4, 5]\n'
    path.write_text(text, encoding="utf-8")
    assert twintip.read_study(str(path)) == twintip.read_study(path)


def test_argument_that_cannot_be_used_is_refused(folder, weights, press):
    report = twintip.read_report(str(folder))
    calibration = twintip.calibrate(report, weights)
    calibrated = calibration.unit
    for field, refused in (
        ("folder", lambda: twintip.read_report(None)),
        ("report", lambda: twintip.read_press(folder, press)),
        ("report", lambda: twintip.calibrate(str(folder), weights)),
        ("report", lambda: twintip.c_header(None)),
        ("unit", lambda: twintip.read_press(report, press, calibration)),
        ("unit", lambda: twintip.micropython(report, calibration)),
        ("file", lambda: twintip.read_press(report, None)),
        ("weights", lambda: twintip.calibrate(report, 3)),
        ("geometry", lambda: twintip.modulus(press, report)),
        ("design", lambda: twintip.run("paper")),
        ("design", lambda: twintip.evaluate(None)),
        ("options", lambda: twintip.run(report.design, folder)),
        ("settings", lambda: twintip.load_design("paper", ["targets.NL"])),
        ("path", lambda: twintip.read_study(None)),
        ("folder", lambda: twintip.run_study(None, 3, None)),
        ("after_s", lambda: twintip.calibrate(report, weights, after_s=-1.0)),
        ("after_s", lambda: twintip.calibrate(report, weights, after_s="30")),
        ("unit.design", lambda: twintip.c_header(report, replace(calibrated, design_sha256="0" * 64))),
        ("fruit.relaxation", lambda: twintip.micropython(report_of_result(relaxing_result()))),
    ):
        with pytest.raises(twintip.InputError) as raised:
            refused()
        assert raised.value.field == field


@pytest.mark.parametrize(
    ("kind", "sizes"),
    [
        (twintip.Ellipsoid, {"height_mm": 70.0, "radius_across_mm": 35.0}),
        (twintip.CylinderOnSide, {"length_mm": 30.0}),
        (twintip.CylinderOnEnd, {"height_mm": 10.0}),
        (twintip.Plunger, {}),
    ],
)
def test_body_or_tool_without_a_radius_is_refused(kind, sizes):
    with pytest.raises(twintip.InputError):
        kind(radius_mm=0.0, **sizes)
