import cadquery as cq
import pytest

from cad.parts.part import named_part, plane_face_test

BOX = cq.Solid.makeBox(1.0, 2.0, 3.0)


def _top(face):
    return abs(face.Center().z - 3.0) < 1e-9


def _level(face):
    return face.BoundingBox().zlen < 1e-6


def test_named_faces_have_their_areas():
    part = named_part("box", BOX, {"top": _top, "sides": lambda face: not _level(face)})
    assert part.face_area("top") == pytest.approx(1.0 * 2.0)
    assert part.face_area("sides") == pytest.approx(2.0 * 3.0 * (1.0 + 2.0))
    assert len(part.faces["sides"]) == 4


@pytest.mark.parametrize("faces", [{"top": _top, "lid": lambda _: False}, {"top": _top, "ends": _level}])
def test_name_without_a_face_and_face_with_two_names_are_refused(faces):
    with pytest.raises(ValueError, match="box"):
        named_part("box", BOX, faces)


def test_brep_file_keeps_the_order_of_the_faces(tmp_path):
    part = named_part("box", BOX, {"top": _top})
    part.write_brep(tmp_path / "box.brep")
    read = cq.Shape.importBrep(str(tmp_path / "box.brep")).Faces()
    assert [face.Area() for face in read] == pytest.approx([face.Area() for face in BOX.Faces()])
    assert [read[i].Center().z for i in part.faces["top"]] == pytest.approx([3.0])


def test_only_the_faces_in_a_plane_are_on_it():
    tilted = BOX.rotate(cq.Vector(0.0, 0.0, 0.0), cq.Vector(1.0, 0.0, 0.0), 1.0)  # one corner still at z = 0
    for shape, count in ((BOX, 1), (tilted, 0), (BOX.translate(cq.Vector(0.0, 0.0, 0.5)), 0)):
        assert sum(plane_face_test(2, 0.0)(face) for face in shape.Faces()) == count
