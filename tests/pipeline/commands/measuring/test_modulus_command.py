"""`pipeline modulus` from the command line: tables, JSON, plot, the range as a design, one line for what is wrong."""

import json
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from virtual_compression import VirtualTest

from pipeline.cli import main
from pipeline.measure.compression.force_law import hertz_law
from pipeline.options import load_design


@pytest.fixture
def files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for E in (0.8, 2.0):
        Path(f"fruit-{E}.csv").write_text(VirtualTest(E_MPa=E, noise_percent=0.2).csv(), encoding="utf-8")
    return ["fruit-0.8.csv", "fruit-2.0.csv"]


def test_json_is_a_list_with_the_contract_s_keys(files, capsys):
    assert main(["modulus", *files, "--json", "--height", "70", "--radius", "35"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert [row["file"] for row in rows] == files
    assert {"E_MPa", "E_hertz_MPa", "E_plate_MPa", "u_percent", "first_touch_mm"} <= rows[0].keys()
    assert [row["E_MPa"] for row in rows] == pytest.approx([0.8, 2.0], rel=0.01)
    assert rows[0]["E_over_1_minus_nu2_MPa"] == pytest.approx(rows[0]["E_MPa"] / 0.91)
    assert sum("assumed" in note for note in rows[0]["notes"]) == 3  # radius across, plate area, Poisson's ratio


@pytest.mark.parametrize(
    ("words", "sizes"),
    [
        ([], [70.0, 35.0, 35.0, 0.3, 900.0, 2]),
        (["--height", "60"], [60.0, 30.0, 30.0, 0.3, 900.0, 2]),
        (["--radius", "40"], [80.0, 40.0, 40.0, 0.3, 900.0, 2]),
        (["--radius-across", "30", "--support", "seat"], [70.0, 35.0, 30.0, 0.3, 900.0, 1]),
        (["--poisson", "0.45", "--plate-area", "400"], [70.0, 35.0, 35.0, 0.45, 400.0, 2]),
    ],
)
def test_sizes_that_no_flag_gives_are_assumed(words, sizes, files, capsys, monkeypatch):
    monkeypatch.setattr("pipeline.measure.compression.modulus.solved_law", hertz_law)  # the sizes alone are looked at
    assert main(["modulus", files[1], "--json", *words]) == 0
    (row,) = json.loads(capsys.readouterr().out)
    assert list(row["geometry"].values()) == sizes


def test_range_is_taken_by_a_design_as_flags_and_as_toml(files, capsys):
    main(["modulus", *files])
    lines = capsys.readouterr().out.splitlines()
    start = lines.index("[fruit]")
    table = tomllib.loads("\n".join(lines[start : start + 3]))["fruit"]
    flags = shlex.split(" ".join(lines[start + 3 :]).partition("pipeline run ")[2])
    settings = dict(text.split("=", 1) for text in flags if text != "--set")
    design = load_design("paper", settings)
    assert design.fruit.E_max_MPa == table["E_max_MPa"] == 2.1
    assert list(design.fruit.E_MPa) == table["E_MPa"]


@pytest.mark.parametrize("kind", ["svg", "png"])
def test_plot_is_the_same_bytes_and_never_replaces_a_foreign_file(kind, files):
    plot = Path(f"plot.{kind}")
    assert main(["modulus", *files, "--plot", str(plot)]) == 0
    first = plot.read_bytes()
    assert main(["modulus", *files, "--plot", str(plot)]) == 0
    assert plot.read_bytes() == first
    plot.write_bytes(b"mine")
    assert main(["modulus", *files, "--plot", str(plot)]) == 2
    assert plot.read_bytes() == b"mine"
    assert main(["modulus", *files, "--plot", str(plot), "--force"]) == 0
    assert Path(f"plot.{kind}.bak").read_bytes() == b"mine"


@pytest.mark.parametrize(
    "words",
    [
        ["none.csv"],
        [],
        ["fruit-2.0.csv", "--height", "nan"],
        ["fruit-2.0.csv", "--height", "high"],
        ["fruit-2.0.csv", "--strain", "five"],
        ["fruit-2.0.csv", "--strain", "0"],
        ["fruit-2.0.csv", "--strain", "5,1e-6"],
        ["fruit-2.0.csv", "--force-unit", "stone"],
        ["fruit-2.0.csv", "--force-unit", "kN"],
        ["fruit-2.0.csv", "--units", "travel=stone"],
        ["fruit-2.0.csv", "--columns", "mass=M"],
        ["fruit-2.0.csv", "--plot", "plot.gif"],
        ["fruit-2.0.csv", "--poisson", "0.5"],
        ["fruit-2.0.csv", "--high", "70"],
    ],
    ids=" ".join,
)
def test_wrong_words_are_one_line_and_write_nothing(words, files, capsys):
    assert main(["modulus", *words]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert len(err.splitlines()) == 1
    assert sorted(path.name for path in Path().iterdir()) == files


@pytest.mark.usefixtures("files")
def test_command_needs_no_cad_kernel_and_no_mesher():
    """It starts fast: neither cadquery nor gmsh nor the viewer is imported."""
    script = (
        "import sys; from pipeline.cli import main; main(['modulus', 'fruit-2.0.csv', '--json']);"
        "print([name for name in ('cadquery', 'OCP', 'gmsh', 'pyvista', 'matplotlib') if name in sys.modules])"
    )
    root = str(Path(__file__).parents[4])
    command = [sys.executable, "-c", f"import sys; sys.path.insert(0, {root!r}); {script}"]
    out = subprocess.run(command, capture_output=True, encoding="utf-8", check=True, timeout=600).stdout
    assert out.splitlines()[-1] == "[]"
