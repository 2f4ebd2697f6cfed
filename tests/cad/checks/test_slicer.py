import shutil

import pytest
import trimesh

import cad.checks.slicer
from cad.checks.slicer import slicer_absence, slicer_verdict, slicer_verdicts

GOOD = "[a.stl]\nsize_x = 20\nmanifold = yes\nnumber_of_parts =  1\n"


@pytest.mark.parametrize(
    "said",
    [
        "", GOOD.replace("yes", "no"), GOOD.replace("  1", "  2"), GOOD + GOOD.replace("yes", "no"),
        "manifold = yes\n", "number_of_parts = 1\n",
    ],
)  # fmt: skip
def test_every_other_answer_fails(said):
    assert slicer_verdict(said).passed is False


def test_one_manifold_part_passes():
    assert slicer_verdict(GOOD).passed is True
    assert slicer_verdict(GOOD + GOOD).passed is True  # two objects of one part each


def test_absent_slicer_is_named_and_skipped(tmp_path, monkeypatch):
    monkeypatch.setattr(cad.checks.slicer, "NAME", "a-slicer-that-nobody-has")
    assert slicer_absence() == "a-slicer-that-nobody-has is not installed: its check is skipped"
    assert slicer_verdicts(tmp_path / "a.stl") == ()


@pytest.mark.skipif(shutil.which(cad.checks.slicer.NAME) is None, reason=f"{cad.checks.slicer.NAME} is not installed")
def test_slicer_tells_an_open_mesh_from_a_closed_one(tmp_path):
    assert slicer_absence() == ""
    mesh = trimesh.creation.box((20.0, 10.0, 5.0))
    mesh.export(tmp_path / "closed.stl")
    mesh.update_faces(mesh.face_normals[:, 2] < 0.5)
    mesh.export(tmp_path / "open.stl")
    assert [slicer_verdicts(tmp_path / f"{name}.stl")[0].passed for name in ("closed", "open")] == [True, False]
