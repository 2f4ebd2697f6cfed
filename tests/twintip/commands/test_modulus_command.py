"""`pipeline modulus` from the command line: tables, JSON, plot, the range as a design, one line for what is wrong."""

import json
import shlex
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from virtual_compression import VirtualTest

from instrument.compress.force_law import POISSON, TestGeometry, hertz_force_law
from instrument.compress.pressed_shapes import Ellipsoid
from pipeline.options import load_design
from twintip.cli import main

SIZES = ["--height", "70", "--radius", "35"]
BALL = TestGeometry(body=Ellipsoid(height_mm=70.0, radius_mm=35.0, radius_across_mm=35.0))


@pytest.fixture
def files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for E in (0.8, 2.0):
        Path(f"fruit-{E}.csv").write_text(VirtualTest(E_MPa=E, noise_percent=0.2).csv(), encoding="utf-8")
    return ["fruit-0.8.csv", "fruit-2.0.csv"]


@pytest.fixture
def law_of_hertz(monkeypatch):
    """Put Hertz's law of a body, or of a ball where it has none, in the place of the solved one."""

    def law(test, _count):
        apparent = hertz_force_law(test) or hertz_force_law(BALL)
        return replace(apparent, variants={POISSON: [apparent]})

    monkeypatch.setattr("instrument.compress.modulus.solve_force_law", law)


@pytest.fixture
def moduli(capsys):
    """Return a function that evaluates tests, and returns their rows."""

    def rows_of(*words):
        code = main(["modulus", *words, "--json"])
        return json.loads(capsys.readouterr().out) if code == 0 else code

    return rows_of


def test_json_is_a_list_with_the_contract_s_keys(files, moduli):
    rows = moduli(*files, *SIZES)
    assert [row["file"] for row in rows] == files
    assert {"E_MPa", "E_hertz_MPa", "E_plate_MPa", "u_percent", "first_touch_mm"} <= rows[0].keys()
    assert [row["E_MPa"] for row in rows] == pytest.approx([0.8, 2.0], rel=0.01)
    assert rows[0]["E_over_1_minus_nu2_MPa"] == pytest.approx(rows[0]["E_MPa"] / 0.91)
    assert sum("assumed" in note for note in rows[0]["notes"]) == 4  # plates, radius, area, nu


@pytest.mark.parametrize(
    ("words", "sizes"),
    [
        ("--radius 40", {"body": "ellipsoid", "height_mm": 80.0, "radius_across_mm": 40.0, "plate_area_mm2": 900.0}),
        ("--body ball --radius 35 --support seat", {"plates": 1, "poisson": 0.3, "plunger": None}),
        (
            "--body cylinder-end --height 20 --radius 8 --support plate --poisson 0.45",
            {"body": "cylinder-end", "height_mm": 20.0, "plate_area_mm2": pytest.approx(201.06, abs=0.01)},
        ),
        (
            "--body block --height 20 --width 15 --length 10 --support plate",
            {"width_mm": 15.0, "plate_area_mm2": 150.0},
        ),
        (
            "--radius 35 --plunger ball --plunger-radius 8 --support table --plate-area 400",
            {"plunger": {"radius_mm": 8.0, "ball": True}, "plate_area_mm2": 400.0},
        ),
    ],
)
@pytest.mark.usefixtures("law_of_hertz")
def test_body_and_tools_are_what_the_flags_say(words, sizes, files, moduli):
    (row,) = moduli(files[1], "--strain", "5", *words.split())
    assert {name: row["geometry"][name] for name in sizes} == sizes


def test_range_is_taken_by_a_design_as_flags_and_as_toml(files, capsys):
    main(["modulus", *files, *SIZES])
    lines = capsys.readouterr().out.splitlines()
    start = lines.index("[fruit]")
    table = tomllib.loads("\n".join(lines[start : start + 3]))["fruit"]
    flags = shlex.split(" ".join(lines[start + 3 :]).partition("pipeline run ")[2])
    settings = dict(text.split("=", 1) for text in flags if text != "--set")
    design = load_design("paper", settings)
    assert design.fruit.E_max_MPa == table["E_max_MPa"] == 2.2
    assert list(design.fruit.E_MPa) == table["E_MPa"]


@pytest.mark.usefixtures("law_of_hertz")
def test_plot_is_the_same_bytes_and_never_replaces_a_foreign_file(files):
    plot = Path("plot.html")
    assert main(["modulus", *files, *SIZES, "--plot", str(plot)]) == 0
    first = plot.read_bytes()
    assert main(["modulus", *files, *SIZES, "--plot", str(plot)]) == 0
    assert plot.read_bytes() == first
    plot.write_bytes(b"mine")
    assert main(["modulus", *files, *SIZES, "--plot", str(plot)]) == 2
    assert plot.read_bytes() == b"mine"


@pytest.mark.usefixtures("law_of_hertz")
def test_compliance_of_the_machine_is_taken_off_and_its_error_counts(files, moduli):
    """A frame of 4 um/N under the force of the clean curve: the modulus is that of the clean curve."""
    (clean,) = moduli(files[1], *SIZES)
    travel, force = np.loadtxt(files[1], delimiter=",", skiprows=1).T
    rows = np.column_stack([travel + 4e-3 * force, force])
    np.savetxt("frame.csv", rows, delimiter=",", header="travel_mm,force_N", comments="", fmt="%.17g")
    mended, exact, stiffer = (
        moduli("frame.csv", *SIZES, "--compliance", *words.split())[0]
        for words in ("4 --compliance-error 1", "4 --compliance-error 0", "5")
    )
    assert mended["E_MPa"] == exact["E_MPa"] == pytest.approx(clean["E_MPa"], rel=2e-3)  # the bar of its scatter
    assert "machine compliance" not in exact["u_shares_percent"]
    moved = 100.0 * (stiffer["E_MPa"] / mended["E_MPa"] - 1.0)  # the range of travel may end elsewhere
    assert mended["u_shares_percent"]["machine compliance"] == pytest.approx(moved, rel=0.1)
    assert stiffer["geometry"]["compliance_error_um_per_N"] == 0.5  # a tenth, as docs/modulus.md has it


@pytest.mark.usefixtures("law_of_hertz")
def test_sizes_are_those_of_each_specimen(files, moduli):
    Path("sizes.csv").write_text(f"file;height;radius [cm]\n{files[0]};70;3,5\n{files[1]};60;3\n", encoding="utf-8")
    first, second = moduli("--sizes", "sizes.csv")
    assert (first["geometry"]["height_mm"], first["geometry"]["radius_mm"]) == (70.0, 35.0)
    assert (second["geometry"]["height_mm"], second["geometry"]["radius_mm"]) == (60.0, 30.0)
    (alone,) = moduli(files[1], "--height", "60", "--radius", "30")
    assert second["E_MPa"] == alone["E_MPa"]
