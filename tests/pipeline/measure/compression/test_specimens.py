"""Files of testing machines in every layout: the same curve comes out of each."""

import numpy as np
import pytest

from pipeline.measure.compression.specimens import QUANTITIES, read_specimens
from pipeline.measure.tables.headers import ColumnFlags
from sensor.quantity import InputError

TRAVEL = np.array([0.0, 0.5, 1.0, 1.5])  # [mm]
FORCE = np.array([0.25, 0.5, 4.0, 9.75])  # [N]
PLAIN = "0.25,0.0\n0.5,0.5\n4.0,1.0\n9.75,1.5\n"
SIDE_BY_SIDE = (
    '"1 _ 1",,,"1 _ 2",,\n"Time","Force","Stroke","Time","Force","Stroke"\n"sec","N","mm","sec","N","mm"\n'
    '"0","0.25","0","0","0.2","0"\n"0.1","0.5","0.5","0.1","0.4","0.5"\n"0.2","4.0","1.0",,,\n"0.3","9.75","1.5",,,\n'
)
SECTIONS = (
    "Name,Max._Force\n,N\n1 _ 1,9.75\n\n"
    "1 _ 1,,\nTime,Force,Stroke\nsec,N,mm\n0,0.25,0\n0.1,0.5,0.5\n0.2,4,1\n0.3,9.75,1.5\n\n"
    "1 _ 2,,\nTime,Force,Stroke\nsec,kN,mm\n0,0.001,0\n0.1,0.002,0.5\n"
)


def read(tmp_path, content, columns=None, units=None):
    path = tmp_path / "test.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_specimens(path, ColumnFlags(columns, units).applied(QUANTITIES))


def assert_is_the_curve(specimen):
    np.testing.assert_allclose(specimen.travel, TRAVEL, rtol=1e-12)
    np.testing.assert_allclose(specimen.force, FORCE, rtol=1e-12)


@pytest.mark.parametrize(
    "content",
    [
        f"force_N,travel_mm\n{PLAIN}",
        f"\ufeffForce,Displacement\nN,mm\n{PLAIN}",
        f"load N\tposition mm\n{PLAIN}".replace(",", "\t"),
        "Kraft [N];Weg [mm]\n0,25;0\n0,5;0,5\n4;1\n9,75;1,5\n",
        f"machine 7,\nspeed,5 mm/min\n\nForce (N),Distance (mm)\n{PLAIN}\n\nlargest,9.75\n",
        # TA.XT with a row of units, and as it names them in its headers; Zwick in cp1252 with a micro sign
        f'"Force","Distance"\n"N","mm"\n{PLAIN}',
        "Force (g)\tDistance (mm)\tTime (sec)\n"
        + "".join(f"{F / 9.80665e-3}\t{x}\t{x}\n" for F, x in zip(FORCE, TRAVEL, strict=True)),
        "Prüfzeit;Standardweg;Standardkraft\ns;µm;N\n0;0;0,25\n1;500,0;0,5\n2;1000,0;4\n3;1500,0;9,75\n".encode(
            "cp1252"
        ),
        SECTIONS.split("1 _ 2,,")[0],
        SECTIONS.split("1 _ 2,,")[0].encode("cp932"),
        SIDE_BY_SIDE,
    ],
)
def test_every_layout_gives_the_same_curve(content, tmp_path):
    specimen = read(tmp_path, content)[0]
    assert_is_the_curve(specimen)
    assert specimen.notes == ()


def test_specimens_side_by_side_end_each_at_its_own_row(tmp_path):
    first, second = read(tmp_path, SIDE_BY_SIDE)
    assert (first.name, second.name) == ("1 _ 1", "1 _ 2")
    assert_is_the_curve(first)
    np.testing.assert_allclose(second.force, [0.2, 0.4])
    np.testing.assert_allclose(second.time, [0.0, 0.1])
    assert first.lines == (4, 5, 6, 7)


def test_sections_are_specimens_with_their_own_units(tmp_path):
    first, second = read(tmp_path, SECTIONS)
    assert (first.name, second.name) == ("1 _ 1", "1 _ 2")
    assert_is_the_curve(first)
    np.testing.assert_allclose(second.force, [1.0, 2.0])


def test_unit_that_is_assumed_is_noted_and_given_by_a_flag(tmp_path):
    (assumed,) = read(tmp_path, f"force,travel\n{PLAIN}")
    assert len(assumed.notes) == 2
    (given,) = read(tmp_path, f"force,travel\n{PLAIN}", units="force=kN,travel=um")
    assert given.notes == ()
    np.testing.assert_allclose(given.force, 1e3 * FORCE)
    np.testing.assert_allclose(given.travel, 1e-3 * TRAVEL)


def test_headers_that_no_machine_has_are_named_by_a_flag(tmp_path):
    (specimen,) = read(tmp_path, f"Last [kN],Pfad\n{PLAIN}", "force=Last [kN],travel=Pfad", "travel=um")
    np.testing.assert_allclose(specimen.force, 1e3 * FORCE)
    np.testing.assert_allclose(specimen.travel, 1e-3 * TRAVEL)


@pytest.mark.parametrize(
    ("content", "place", "value"),
    [
        ("1,2\n3,4\n", "line 1", "1,2"),
        ("force_N,temperature_C\n1,2\n", "line 1", "force_N,temperature_C"),
        ("force_N,travel_mm\n1,0\n2\n3,2\n", "line 3, column 'travel_mm'", ""),
        ("force_N,travel_mm\n1,5,0,5\n", "line 2", 4),
        ("force_N,travel_mm\n1,0\n\n2,1\n", "line 4", "2,1"),
        ("force_N,stroke_mm,position_mm\n1,0,0\n", "line 1", "position_mm"),
        ("force_N,travel_mm\n1,0\n2,1\nforce_N,travel_mm\n", "line 4, column 'force_N'", "force_N"),
    ],
)
def test_wrong_file_is_refused_with_its_place(content, place, value, tmp_path):
    with pytest.raises(InputError) as caught:
        read(tmp_path, content)
    assert caught.value.field == f"{tmp_path / 'test.csv'}, {place}"
    assert caught.value.value == value


def test_unit_of_flag_and_file_may_not_differ(tmp_path):
    with pytest.raises(InputError) as caught:
        read(tmp_path, f"force_N,travel_mm\n{PLAIN}", units="force=kN")
    assert caught.value.value == "N"
