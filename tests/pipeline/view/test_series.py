"""A press as a series: fields of the run at full travel, in proportion to the travel before."""

import xml.etree.ElementTree as ET

import numpy as np
import pytest
import pyvista as pv
from view_stand_ins import change_report, write_output_folder

from pipeline.cli import main
from pipeline.report.report import read_data, read_report
from pipeline.view.series import write_series
from sensor.quantity import InputError

TABLES = ("x_mm", "P", "F_l_N", "F_h_N")  # of three travels instead of twelve


@pytest.mark.parametrize("change", [{"housing": None}, {"response": []}])
def test_folder_without_a_housing_or_a_response_is_refused(change, tmp_path):
    folder = write_output_folder(tmp_path / "out", **change)
    with pytest.raises(InputError) as caught:
        write_series(folder, tmp_path / "series")
    assert caught.value.field == "DIR"
    assert not (tmp_path / "series").exists()


@pytest.mark.slow
def test_series_grows_with_the_travel_to_the_fields_of_the_run(run_with_fields, tmp_path):
    rows = read_data(run_with_fields)["response"]
    change_report(run_with_fields, response=[{**row, **{key: row[key][3::4] for key in TABLES}} for row in rows])
    assert main(["view", str(run_with_fields), "--pvd", str(tmp_path)]) == 0
    report = read_report(run_with_fields)
    travels = report.response[-1].x_mm
    for kind, array in (("flexure", "displacement_mm"), ("fruit", "stress_MPa")):
        steps = ET.fromstring((tmp_path / f"{kind}.pvd").read_text(encoding="utf-8")).iter("DataSet")
        files = {float(step.get("timestep")): tmp_path / step.get("file") for step in steps}
        assert list(files) == pytest.approx(list(travels))
        largest = np.array([np.abs(pv.read(path).point_data[array]).max() for path in files.values()])
        # flat faces on a flat fruit: in proportion to the travel
        assert largest == pytest.approx(np.array(travels) / travels[-1] * largest[-1], rel=1e-5)
    written = pv.read(run_with_fields / "fruit.vtu").point_data["displacement_mm"]
    last = pv.read(tmp_path / "fruit_02.vtu").point_data["displacement_mm"]
    np.testing.assert_allclose(last, written, atol=1e-3 * np.abs(written).max())
