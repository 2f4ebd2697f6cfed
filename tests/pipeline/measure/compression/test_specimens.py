"""Files of testing machines in every layout: the same curve comes out of each."""

from pathlib import Path

import numpy as np
import pytest

from cad.quantity import InputError
from pipeline.measure.compression.specimens import Specimen, read_specimens

TRAVEL = np.array([0.0, 0.5, 1.0, 1.5])  # mm
FORCE = np.array([0.25, 0.5, 4.0, 9.75])  # N
PLAIN = "".join(f"{F},{x}\n" for F, x in zip(FORCE, TRAVEL, strict=True))
SIDE_BY_SIDE = (
    '"1 _ 1",,,"1 _ 2",,\n"Time","Force","Stroke","Time","Force","Stroke"\n"sec","N","mm","sec","N","mm"\n'
    '"0","0.25","0","0","0.2","0"\n"0.1","0.5","0.5","0.1","0.4","0.5"\n"0.2","4.0","1.0",,,\n"0.3","9.75","1.5",,,\n'
)
SECTIONS = (
    "サンプル,試験種類,速度\nmango,圧縮,5\n\n形状,板\n名前,厚さ,幅\n単位,mm,mm\n1 _ 1,30,30\n\n"
    "名前,最大点_試験力\n,N\n1 _ 1,9.75\n\n"
    "1 _ 1,,\n時間,試験力,ストローク\nsec,N,mm\n0,0.25,0\n0.1,0.5,0.5\n0.2,4,1\n0.3,9.75,1.5\n\n"
    "1 _ 2,,\n時間,試験力,ストローク\nsec,kN,mm\n0,0.001,0\n0.1,0.002,0.5\n"
)


def read(tmp_path: Path, content: str | bytes, **units: str) -> list[Specimen]:
    path = tmp_path / "test.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_specimens(path, units)


def assert_is_the_curve(specimen: Specimen) -> None:
    np.testing.assert_allclose(specimen.travel, TRAVEL, rtol=1e-12)
    np.testing.assert_allclose(specimen.force, FORCE, rtol=1e-12)


@pytest.mark.parametrize(
    "content",
    [
        f"force_N,travel_mm\n{PLAIN}",
        f"Force (N),Stroke [mm]\n{PLAIN}",
        f"\ufeffForce,Displacement\nN,mm\n{PLAIN}",
        f"load N\tposition mm\n{PLAIN}".replace(",", "\t"),
        "Kraft [N];Weg [mm]\n0,25;0\n0,5;0,5\n4;1\n9,75;1,5\n",
        '"force_N","travel_mm"\n"0,25","0"\n"0,5","0,5"\n"4","1"\n"9,75","1,5"\n',
        f"machine 7,\nspeed,5 mm/min\n\nforce_N,travel_mm\n{PLAIN}\n\n",
        f"force_N,travel_mm\n{PLAIN}".replace("\n", "\r\n"),
        f"force_N,travel_mm\n{PLAIN}".encode("utf-16"),
        "travel_mm,force_N\n0,0.25\n0.5,0.5\n1,4\n1.5,9.75\n",
        "force_kN,travel_m\n0.00025,0\n0.0005,0.0005\n0.004,0.001\n0.00975,0.0015\n",
        "Force (mN),Travel (µm)\n250,0\n500,500\n4000,1000\n9750,1500\n",
        SECTIONS.split("1 _ 2,,")[0],
        SECTIONS.split("1 _ 2,,")[0].encode("cp932"),
        ("\ufeff" + SIDE_BY_SIDE),
    ],
)  # fmt: skip
def test_every_layout_gives_the_same_curve(content: str | bytes, tmp_path: Path):
    specimen = read(tmp_path, content)[0]
    assert_is_the_curve(specimen)
    assert specimen.notes == ()


def test_kilogram_force_and_inch_are_exact(tmp_path: Path):
    (specimen,) = read(tmp_path, "Force (kgf),Stroke (inch)\n1,0\n2,1\n")
    np.testing.assert_allclose(specimen.force, [9.80665, 2 * 9.80665], rtol=1e-15)
    np.testing.assert_allclose(specimen.travel, [0.0, 25.4], rtol=1e-15)


def test_specimens_side_by_side_end_each_at_its_own_row(tmp_path: Path):
    first, second = read(tmp_path, SIDE_BY_SIDE)
    assert (first.name, second.name) == ("1 _ 1", "1 _ 2")
    assert_is_the_curve(first)
    np.testing.assert_allclose(second.force, [0.2, 0.4])
    assert second.time is not None
    assert first.lines == (4, 5, 6, 7)


def test_sections_are_specimens_with_their_own_units(tmp_path: Path):
    first, second = read(tmp_path, SECTIONS.encode("cp932"))
    assert (first.name, second.name) == ("1 _ 1", "1 _ 2")
    assert_is_the_curve(first)
    np.testing.assert_allclose(second.force, [1.0, 2.0])


def test_assumed_unit_is_said_and_a_flag_replaces_it(tmp_path: Path):
    (assumed,) = read(tmp_path, f"force,travel\n{PLAIN}")
    assert [note.split(":")[0] for note in assumed.notes] == [
        "the unit of 'force' is not given",
        "the unit of 'travel' is not given",
    ]
    (given,) = read(tmp_path, f"force,travel\n{PLAIN}", force="kN", travel="um")
    assert given.notes == ()
    np.testing.assert_allclose(given.force, 1e3 * FORCE)
    np.testing.assert_allclose(given.travel, 1e-3 * TRAVEL)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("", "it is empty"),
        ("\n \n", "it is empty"),
        (b"\x7fELF\x00\x00\x01", "must be a text file"),
        (b"force_N,travel_mm\n\xff\xfe\x81,1\n", "UTF-8"),
        ("1,2\n3,4\n", "line 1 = '1,2': must be a table whose header names a force and a travel"),
        ("force_N,temperature_C\n1,2\n", "whose header names a force and a travel"),
        ("force (dyn),travel_mm\n1,2\n", "unit of the force = 'dyn': must be one of N, kN"),
        ("force (MN),travel_mm\n1,2\n", "unit of the force = 'MN'"),
        ("force_N,travel_mm\n1,0\nabc,1\n", "line 3, column 'force_N' = 'abc': must be a finite number"),
        ("force_N,travel_mm\n1,0\n2,nan\n", "line 3, column 'travel_mm' = 'nan'"),
        ("force_N,travel_mm\n1,0\ninf,1\n", "line 3, column 'force_N' = 'inf'"),
        ("force_N,travel_mm\n1,0\n,1\n2,2\n", "line 3, column 'force_N' = '': must be a number, and the cell is empty"),
        ("force_N,travel_mm\n1,0\n2\n3,2\n", "line 3, column 'travel_mm' = ''"),
        ("force_N,travel_mm\n1,5,0,5\n", "line 2 = '1,5,0,5': must be 2 cells as in the header, and it has 4"),
        ("force_N;travel_mm\n1.5;0,5\n", "numbers with one decimal sign"),
        ("force_N;travel_mm\n1,500;2,000\n", "a number whose comma is surely decimal"),
        ("force_N,travel_mm\n1,0\n\n2,1\n", "line 4 = '2,1': must be a header, or the end of the file"),
        ("force_N,stroke_mm,position_mm\n1,0,0\n", "for each specimen one force and one travel"),
    ],
)
def test_wrong_file_is_refused_with_its_place(content: str | bytes, words: str, tmp_path: Path):
    with pytest.raises(InputError) as error:
        read(tmp_path, content)
    assert words in str(error.value)
    assert "test.csv" in str(error.value) or "unit of the force" in str(error.value)
    assert "\n" not in str(error.value)


def test_unit_of_flag_and_file_may_not_differ(tmp_path: Path):
    with pytest.raises(InputError, match="the unit that --force-unit gives, kN"):
        read(tmp_path, f"force_N,travel_mm\n{PLAIN}", force="kN")


def test_missing_file_and_folder_are_refused(tmp_path: Path):
    for path in (tmp_path / "none.csv", tmp_path):
        with pytest.raises(InputError, match="must be an existing CSV file"):
            read_specimens(path, {})
