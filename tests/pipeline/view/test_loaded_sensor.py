"""Fields at any modulus and travel: those of the run at the run's own, in proportion to the force elsewhere."""

import json
import shutil
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest
import pyvista as pv
from view_stand_ins import change_report

from cad.quantity import InputError
from pipeline.cli import main
from pipeline.report.stored import StoredResponse, read_report
from pipeline.view.loaded_sensor import as_drawn, forces_at, fruit_under, housing_of

TABLES = ("x_mm", "P", "F_l_N", "F_h_N")  # of three travels instead of twelve
SPRINGS, OWN, CROSS = (0.9, 20.0), 0.7666, 0.0105  # N/mm, 1/mm


def exact(E, x, cross=0.0):
    """Return the forces [N] of two springs on a linear fruit: x = F / K + S F / E."""
    S = np.array([[OWN, cross], [cross, OWN]])
    return np.linalg.solve(np.diag(1.0 / np.array(SPRINGS)) + S / E, [x, x])


def stored(cross=0.0):
    travels = tuple(np.linspace(0.05, 0.6, 12).tolist())
    rows = []
    for E in (0.5, 1.0, 2.0, 3.5):
        low, high = np.array([exact(E, x, cross) for x in travels]).T.tolist()
        rows.append(StoredResponse(E_MPa=E, x_mm=travels, P=(), F_l_N=tuple(low), F_h_N=tuple(high)))
    return rows


@pytest.mark.parametrize("E", [0.5, 0.7, 1.3, 3.0, 3.5])
@pytest.mark.parametrize("x", [0.01, 0.3, 0.33, 0.6])
def test_forces_between_rows_are_exact_where_tips_do_not_disturb_each_other(E, x):
    assert forces_at(stored(), E, x) == pytest.approx(exact(E, x), rel=1e-12)
    # and else as near as the crosstalk is small: its square over the own compliance
    assert forces_at(stored(CROSS), E, x) == pytest.approx(exact(E, x, CROSS), rel=CROSS / OWN)


def test_forces_outside_the_moduli_are_those_of_the_nearest():
    assert forces_at(stored(), 9.0, 0.3) == pytest.approx(exact(3.5, 0.3), rel=1e-12)
    assert forces_at(stored(), 1.0, 0.0) == (0.0, 0.0)


def test_tip_off_the_fruit_carries_nothing():
    rows = [StoredResponse(E_MPa=E, x_mm=(0.3, 0.6), P=(), F_l_N=(0.0, 0.1 * E), F_h_N=(1.0, 2.0)) for E in (1.0, 2.0)]
    assert forces_at(rows, 1.0, 0.3)[0] == 0.0
    assert forces_at(rows, 1.0, 0.45)[0] == pytest.approx(0.05)


def test_folder_without_a_housing_is_named(stand_in_folder):
    report = replace(read_report(stand_in_folder), housing=None)
    with pytest.raises(InputError, match=r"^DIR = '.*" + stand_in_folder.name + "': must be an output folder with a"):
        housing_of(report, stand_in_folder)
    spring = replace(report.springs["low"], stiffness_N_per_m=None)
    unmade = replace(report, springs={**report.springs, "low": spring})
    with pytest.raises(InputError, match=r"^DIR = '.*" + stand_in_folder.name + "': must be an output folder with s"):
        fruit_under(unmade, stand_in_folder, 1.0, 0.1)


@pytest.mark.slow
def test_fields_of_the_run_are_those_of_its_unit_loads(run_with_fields):
    report = read_report(run_with_fields)
    housing = housing_of(report, run_with_fields)
    judged = [
        1e-3 * report.springs[name].stiffness_N_per_m * deflection
        for name, deflection in zip(("low", "high"), report.deflections_mm, strict=True)
    ]
    written = pv.read(run_with_fields / "flexure.vtu")
    drawn = as_drawn(housing.mesh, housing.under(judged))
    for name in ("displacement_mm", "von_mises_MPa", "largest_principal_strain", "stress_MPa"):
        size = np.abs(written.point_data[name]).max()
        np.testing.assert_allclose(drawn.point_data[name], written.point_data[name], atol=4e-6 * size)
    travel, E = report.design.press.travel_mm, report.design.largest_E_MPa
    fruit = as_drawn(*fruit_under(report, run_with_fields, E, travel))
    written = pv.read(run_with_fields / "fruit.vtu")
    size = np.abs(written.point_data["displacement_mm"]).max()
    np.testing.assert_allclose(
        fruit.point_data["displacement_mm"], written.point_data["displacement_mm"], atol=1e-3 * size
    )


@pytest.mark.slow
def test_series_over_the_travel_grows_with_it_and_is_the_same_every_time(run_with_fields, tmp_path):
    folder = shutil.copytree(run_with_fields, tmp_path / "out")
    first = json.loads((folder / "report.json").read_text(encoding="utf-8"))["response"]
    change_report(folder, response=[{**row, **{key: row[key][3::4] for key in TABLES}} for row in first])
    for name in ("once", "again"):
        assert main(["view", str(folder), "--pvd", str(tmp_path / name)]) == 0
    names = sorted(path.name for path in (tmp_path / "once").iterdir())
    assert [(tmp_path / "again" / name).read_bytes() for name in names] == [
        (tmp_path / "once" / name).read_bytes() for name in names
    ]
    report = read_report(folder)
    for kind, array in (("flexure", "displacement_mm"), ("fruit", "stress_MPa")):
        steps = ET.fromstring((tmp_path / "once" / f"{kind}.pvd").read_text(encoding="utf-8")).iter("DataSet")
        files = {float(step.get("timestep")): tmp_path / "once" / step.get("file") for step in steps}
        assert list(files) == pytest.approx(list(report.response[-1].x_mm))
        largest = {x: np.abs(pv.read(path).point_data[array]).max() for x, path in files.items()}
        full = max(largest)
        # flat faces on a flat fruit: in proportion to the travel
        assert list(largest.values()) == pytest.approx([x / full * largest[full] for x in largest], rel=1e-5)
        assert len(pv.get_reader(tmp_path / "once" / f"{kind}.pvd").time_values) == len(files)
