"""Pictures show what they say: colour where there is stress, one file per thing in the folder."""

import numpy as np
import pytest
import pyvista as pv
from refusal import refusal
from stand_ins import result_of
from view_stand_ins import change_report, half_beam, write_output_folder

from pipeline.report.outputs import write_outputs
from pipeline.storage.vtu import write_vtu
from pipeline.view import pictures as viewer
from pipeline.view.pictures import pictures, show_pictures, write_pictures
from twintip.cli import main

FLEXURES = ["flexure-low", "flexure-low-limit", "flexure-high", "flexure-high-limit"]
NAMES = ["housing", "assembly", "exploded", *FLEXURES, "fruit", "mesh"]


@pytest.fixture(autouse=True)
def _small_pictures(monkeypatch):
    monkeypatch.setattr(viewer, "SIZE", (480, 320))


def pixels(folder, names, target):
    """Return pictures of a folder as arrays of colours, by name."""
    paths = write_pictures([picture for picture in pictures(folder) if picture.name in names], target)
    return {path.stem: np.asarray(pv.read(path)["PNGImage"]).astype(int)[:, :3] for path in paths}


def dark_red(picture):
    red, green, blue = picture.T
    return float(np.mean((red > 100) & (green < 30) & (blue < 60)))


@pytest.mark.slow
def test_every_picture_has_its_size_and_something_on_white(stand_in_folder, tmp_path):
    drawn = pixels(stand_in_folder, NAMES, tmp_path / "new" / "png")
    assert list(drawn) == NAMES
    for name, picture in drawn.items():
        assert picture.shape[0] == 480 * 320
        white = float(np.mean(picture.min(axis=1) > 250))
        assert (0.0 if name == "fruit" else 0.03) <= white < 0.985, name
    assert dark_red(drawn["flexure-high"]) > 0.005


def test_folder_of_a_run_without_fields_has_its_solids_and_mesh(tmp_path):
    folder = write_output_folder(tmp_path / "out")
    write_vtu(folder / "flexure.vtu", half_beam(), {})
    (folder / "fruit.vtu").unlink()
    names = [picture.name for picture in pictures(folder)]
    assert names == ["housing", "assembly", "exploded", "mesh"]


def test_folder_with_nothing_to_show_is_refused(tmp_path):
    write_outputs(result_of(), tmp_path)
    change_report(tmp_path, housing=None)
    assert refusal(pictures, tmp_path).field == "DIR"


def test_empty_solid_is_refused_and_leaves_no_picture(tmp_path):
    folder = write_output_folder(tmp_path / "out")
    (folder / "housing.stl").write_bytes(bytes(84))
    assert main(["view", str(folder), "--png", str(tmp_path / "png")]) == 2
    assert not (tmp_path / "png").exists()


def test_picture_folder_that_is_a_file_is_refused(stand_in_folder, tmp_path):
    (tmp_path / "file").write_text("", encoding="utf-8")
    assert refusal(write_pictures, pictures(stand_in_folder)[:1], tmp_path / "file").field == "--png"


def test_without_a_display_a_window_is_refused(monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    assert refusal(show_pictures, [], "paper").field == "display"
