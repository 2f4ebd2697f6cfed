import dataclasses

import cadquery as cq
import pytest

from cad.parts.part import named_part

BOX = cq.Solid.makeBox(1.0, 2.0, 3.0)


def _top(face: cq.Face) -> bool:
    return abs(face.Center().z - 3.0) < 1e-9


def _level(face: cq.Face) -> bool:
    return face.BoundingBox().zlen < 1e-6


def test_named_faces_have_their_areas():
    part = named_part("box", BOX, {"top": _top, "sides": lambda face: not _level(face)})
    assert part.face_area("top") == pytest.approx(1.0 * 2.0)
    assert part.face_area("sides") == pytest.approx(2.0 * 3.0 * (1.0 + 2.0))
    assert len(part.faces["sides"]) == 4


def test_name_without_a_face_lists_the_known_names():
    with pytest.raises(ValueError, match=r"^part 'box': the name 'lid' matches no face; known names: top, lid$"):
        named_part("box", BOX, {"top": _top, "lid": lambda _: False})


def test_face_with_two_names_is_refused():
    with pytest.raises(ValueError, match=r"^part 'box': face \d is named both 'top' and 'ends'$"):
        named_part("box", BOX, {"top": _top, "ends": _level})


def test_unknown_face_lists_the_known_ones():
    part = named_part("box", BOX, {"top": _top, "sides": lambda face: not _level(face)})
    with pytest.raises(KeyError, match="face 'tip' is unknown on part 'box'; known faces: top, sides"):
        part.face_area("tip")


def test_brep_file_keeps_the_order_of_the_faces(tmp_path):
    part = named_part("box", BOX, {"top": _top})
    part.write_brep(tmp_path / "box.brep")
    read = cq.Shape.importBrep(str(tmp_path / "box.brep")).Faces()
    assert [face.Area() for face in read] == pytest.approx([face.Area() for face in BOX.Faces()])
    assert [read[i].Center().z for i in part.faces["top"]] == pytest.approx([3.0])


def test_brep_file_that_cannot_be_written_says_so(tmp_path):
    part = named_part("box", BOX, {"top": _top})
    with pytest.raises(OSError, match=r"part 'box': cannot write .*absent.*; check that the folder exists"):
        part.write_brep(tmp_path / "absent" / "box.brep")


def test_part_is_frozen():
    part = named_part("box", BOX, {"top": _top})
    with pytest.raises(dataclasses.FrozenInstanceError, match="cannot assign to field 'name'"):
        part.name = "other"
