"""`pipeline check` of a folder with strips: its own files pass, and a missing or a wrong one fails by name."""

import shutil
from types import SimpleNamespace

import pytest
from steel_strips import DEFLECTIONS, PAIR, steel_sensor

from cad.drawing.sheet import Title
from cad.fabrication.bridges import Spring, SpringReadOut
from cad.fabrication.fabrication_files import write_fabrication
from cad.files.sensor_files import write_sensor
from pipeline.report import check


@pytest.mark.slow
def test_strips_and_tool_of_a_folder_are_measured(tmp_path, monkeypatch):
    sensor = steel_sensor()
    report = SimpleNamespace(design=PAIR, housing=sensor.housing, deflections_mm=DEFLECTIONS, files=())
    monkeypatch.setattr(check, "read_data", lambda _: {})
    monkeypatch.setattr(check, "report_of", lambda *_: report)
    springs = [Spring(name=arm.name, flexure=arm.flexure, K=1.0, deflection=0.1) for arm in sensor.housing.arms]
    write_sensor(sensor, tmp_path)
    write_fabrication(sensor, Title(name="steel", process=PAIR.process), SpringReadOut(springs=springs), tmp_path)

    def failed():
        return [verdict.name for verdict in check.folder_geometry(tmp_path) if verdict.passed is not True]

    assert failed() == []
    shutil.copy(tmp_path / "strips.step", tmp_path / "spacer.step")
    shutil.copy(tmp_path / "cover.step", tmp_path / "strips.step")
    assert {"geometry.spacer", "geometry.strip_ends", "geometry.leaf_thickness_low"} <= set(failed())
    (tmp_path / "strips.step").unlink()
    (verdict,) = check.folder_geometry(tmp_path)
    assert (verdict.name, verdict.passed) == ("geometry.readable", False)
    assert "strips.step" in verdict.reference
