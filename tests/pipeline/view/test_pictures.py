"""Pictures show what they say: colour where there is stress, labels at the tips, one file per thing in the folder."""

from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
from stand_ins import result_of
from view_stand_ins import change_report, plate, write_output_folder

from cad.design.tips import Tips
from cad.quantity import InputError
from pipeline.cli import main
from pipeline.report.outputs import write_outputs
from pipeline.report.stored import read_report
from pipeline.view import pictures as viewer
from pipeline.view.pictures import pictures, write_pictures
from pipeline.view.printed_part import tip_points
from pipeline.view.response_chart import force_ratios
from pipeline.view.scenes import scene
from pipeline.view.scenes.scene import deformation_factor
from pipeline.view.window import show_pictures, window_of

FLEXURES = [f"flexure-{spring}{what}" for spring in ("low", "high") for what in ("", "-limit")]
NAMES = ["housing", "assembly", "exploded", *FLEXURES, "fruit", "mesh", "response"]


def view(folder: Path, png: Path) -> int:
    return main(["view", str(folder), "--png", str(png)])


@pytest.fixture(scope="module")
def drawn(stand_in_folder, tmp_path_factory) -> dict[str, np.ndarray]:
    """Return the pictures of one output folder as arrays of colours, by name."""
    folder = tmp_path_factory.mktemp("view")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(viewer, "SIZE", (480, 320))
        assert view(stand_in_folder, folder / "new" / "png") == 0
    assert sorted(path.name for path in (folder / "new" / "png").iterdir()) == sorted(f"{name}.png" for name in NAMES)
    return {path.stem: np.asarray(pv.read(path)["PNGImage"]) for path in (folder / "new" / "png").iterdir()}


def share_like(picture: np.ndarray, wanted) -> float:
    """Return the share of the picture whose red, green, blue fulfil a condition."""
    red, green, blue = picture.astype(int)[:, :3].T
    return float(np.mean(wanted(red, green, blue)))


@pytest.mark.parametrize("name", NAMES)
def test_picture_has_the_asked_size_and_something_on_white(name, drawn):
    assert drawn[name].shape[0] == 480 * 320
    white = share_like(drawn[name], lambda r, g, b: (r > 250) & (g > 250) & (b > 250))
    assert (0.0 if name == "fruit" else 0.03) <= white < 0.97  # the fruit fills its picture


def test_flexure_is_coloured_by_stress(drawn):
    """From pale yellow at no stress to dark red at the most: both ends are there, in the part or its scale bar."""
    assert share_like(drawn["flexure-high"], lambda r, g, b: (r > 100) & (g < 30) & (b < 60)) > 0.005
    assert share_like(drawn["flexure-high"], lambda r, g, b: (r > 200) & (g > 190) & (b < g - 30)) > 0.01


def test_housing_carries_red_labels(drawn):
    assert share_like(drawn["housing"], lambda r, g, b: (r > 150) & (g < 110) & (b < 100)) > 2e-4


def test_response_has_its_blue_curve(drawn):
    assert share_like(drawn["response"], lambda r, g, b: (b > r + 60) & (b > g + 20)) > 1e-3


def test_same_folder_same_names_in_order(stand_in_folder):
    assert [picture.name for picture in pictures(stand_in_folder)] == NAMES


def test_folder_of_a_run_without_fields_has_its_solids_mesh_and_response(default_run):
    assert [picture.name for picture in pictures(default_run.folder)] == [
        "housing",
        "assembly",
        "exploded",
        "mesh",
        "response",
    ]


@pytest.mark.parametrize("turned", [0.0, 180.0])
def test_tips_are_found_from_the_solid_in_either_pose(turned):
    part = plate().rotate_x(turned)
    tips = tip_points(np.asarray(part.points), Tips())
    expected = pv.PolyData([(-4.0, 0.0, 2.5), (4.0, 0.0, 2.5)]).rotate_x(turned).points
    assert tips == pytest.approx(np.asarray(expected), abs=1e-5)  # single precision of STL


def test_part_without_such_tips_gets_no_labels():
    assert tip_points(np.asarray(plate().points), Tips(side_mm=2.0)) is None
    assert tip_points(np.asarray(pv.Sphere().points), Tips()) is None


@pytest.mark.parametrize(
    ("largest", "length", "factor"),
    [(0.4, 78.0, 10.0), (0.1, 10.0, 5.0), (1e-6, 10.0, 5e5), (8.0, 100.0, 1.0), (20.0, 100.0, 1.0), (0, 1, 1)],
)
def test_deformation_is_drawn_at_eight_percent_of_the_part_or_the_next_round_factor_below(largest, length, factor):
    assert deformation_factor(largest, length) == pytest.approx(factor, rel=1e-12)


def rows(*P):
    return [{"E_MPa": 1.0 + place, "x_mm": [0.3, 0.6], "P": list(each)} for place, each in enumerate(P)]


@pytest.mark.parametrize(
    ("response", "ratios"),
    [
        (rows((1.5, 2.0), (2.5, 3.0), (4.5, None)), ([1.0, 2.0, 3.0], [2.0, 3.0, 4.5])),
        (rows((None, None), (None, 3.0)), ([2.0], [3.0])),
    ],
    ids=["touching", "lifted"],
)
def test_force_ratio_is_that_of_the_deepest_travel_with_both_tips_down(response, ratios, tmp_path):
    assert force_ratios(read_report(write_output_folder(tmp_path / "out", response=response))) == ratios


def test_response_without_a_ratio_is_refused(tmp_path, capsys):
    folder = write_output_folder(tmp_path / "out", response=rows((None, None)), housing=None)
    for path in (*folder.glob("*.vtu"), folder / "housing.stl"):
        path.unlink()  # the chart is all there is to draw
    assert view(folder, tmp_path / "png") == 2
    assert "must be a P at one modulus at least; press deeper or level" in capsys.readouterr().err


@pytest.mark.parametrize("text", [None, "", "[]", "{}", '{"schema": 1'])
def test_folder_that_is_no_output_folder_is_refused(text, tmp_path, capsys):
    if text is not None:
        (tmp_path / "report.json").write_text(text, encoding="utf-8")
    before = list(tmp_path.iterdir())
    assert view(tmp_path, tmp_path / "png") == 2
    error = capsys.readouterr().err
    assert error.startswith(f"pipeline: PATH = {str(tmp_path)!r}: ")
    assert error.endswith("; name an output folder, or run the design again\n")
    assert list(tmp_path.iterdir()) == before


def test_folder_with_nothing_to_show_is_refused(tmp_path, capsys):
    write_outputs(result_of(), tmp_path)
    change_report(tmp_path, response=[], housing=None)
    assert view(tmp_path, tmp_path / "png") == 2
    assert "must be an output folder with a housing.stl, a .vtu file or a response to show" in capsys.readouterr().err


def test_empty_solid_is_refused_and_leaves_no_picture(tmp_path, capsys):
    folder = write_output_folder(tmp_path / "out")
    (folder / "housing.stl").write_bytes(bytes(84))
    assert view(folder, tmp_path / "png") == 2
    assert "housing.stl': must be a mesh with at least one cell; write it again" in capsys.readouterr().err
    assert not (tmp_path / "png").exists()


def test_picture_folder_that_is_a_file_is_refused(tmp_path):
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(InputError, match=r"^--png = '.*file': must be a folder that can be written .*; name another"):
        write_pictures([], tmp_path / "file")


def test_without_a_display_a_window_is_refused(monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(InputError, match=r"^display = None: must be one that can open a window; .*--png DIR$"):
        show_pictures([], "paper")


def test_window_has_a_place_for_each_scene(stand_in_folder, monkeypatch):
    monkeypatch.setattr(pv, "OFF_SCREEN", True)
    window = window_of(pictures(stand_in_folder), "stand-in")
    try:
        assert [len(renderer.actors) > 0 for renderer in window.renderers] == [True] * 6
    finally:
        window.close()


def test_planted_flat_field_would_show_no_dark_red(tmp_path, monkeypatch):
    """Stress at its largest makes the dark red of the picture; without that end of the colours there is none."""
    folder = write_output_folder(tmp_path / "out")
    monkeypatch.setattr(viewer, "SIZE", (480, 320))
    monkeypatch.setattr(scene, "COLOURS", ["#ffffcc", "#fed976"])
    (flexure,) = (picture for picture in pictures(folder) if picture.name == "flexure-high")
    (path,) = write_pictures([flexure], tmp_path / "png")
    found = np.asarray(pv.read(path)["PNGImage"])
    assert share_like(found, lambda r, g, b: (r > 100) & (g < 30) & (b < 60)) < 1e-4
