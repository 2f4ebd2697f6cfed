import zipfile

import pytest
import trimesh

from cad.checks.triangle_checks import library_mesh
from cad.files.threemf import read_3mf, write_3mf


def two_boxes():
    return {
        "low <L> & co": trimesh.creation.box((1.0, 2.0, 3.0)),
        "high": trimesh.creation.box((2.0, 2.0, 2.0)).apply_translation((5.0, 0.0, 0.0)),
    }


def test_strict_reader_finds_one_named_object_a_body(tmp_path):
    write_3mf(two_boxes(), tmp_path / "two.3mf")
    package = read_3mf(tmp_path / "two.3mf")
    assert package.names == ("low <L> & co", "high")
    assert package.warnings == ()
    assert float(package.mesh.volume) == pytest.approx(6.0 + 8.0, rel=1e-6)
    mesh = library_mesh(package.mesh)
    assert mesh.body_count == 2
    assert mesh.is_watertight


@pytest.mark.parametrize("name", ["'", '"', "<&>", "it's &#x27;"])
def test_name_with_signs_of_xml_comes_back(tmp_path, name):
    write_3mf({name: trimesh.creation.box((1.0, 2.0, 3.0))}, tmp_path / "named.3mf")
    assert read_3mf(tmp_path / "named.3mf").names == (name,)


def test_same_bytes_again(tmp_path):
    for name in ("a.3mf", "b.3mf"):
        write_3mf(two_boxes(), tmp_path / name)
    assert (tmp_path / "a.3mf").read_bytes() == (tmp_path / "b.3mf").read_bytes()


def rewritten(path, old, new):
    with zipfile.ZipFile(path) as package:
        parts = {name: package.read(name).decode() for name in package.namelist()}
    with zipfile.ZipFile(path, "w") as package:
        for name, text in parts.items():
            package.writestr(name, text.replace(old, new))


def test_unit_of_the_file_counts(tmp_path):
    write_3mf(two_boxes(), tmp_path / "inch.3mf")
    rewritten(tmp_path / "inch.3mf", 'unit="millimeter"', 'unit="inch"')
    assert float(read_3mf(tmp_path / "inch.3mf").mesh.volume) == pytest.approx(14.0 * 25.4**3, rel=1e-6)


@pytest.mark.parametrize(
    ("old", "new"), [('objectid="2"', 'objectid="3"'), ('v1="0"', 'v1="99"'), ('unit="millimeter"', 'unit="parsec"')]
)
def test_planted_fault_is_refused(tmp_path, old, new):
    write_3mf(two_boxes(), tmp_path / "bad.3mf")
    rewritten(tmp_path / "bad.3mf", old, new)
    with pytest.raises(ValueError, match=r"bad.3mf is refused by lib3mf in strict mode"):
        read_3mf(tmp_path / "bad.3mf")


def test_package_without_triangles_is_refused(tmp_path):
    write_3mf({}, tmp_path / "none.3mf")
    with pytest.raises(ValueError, match=r"none.3mf"):
        read_3mf(tmp_path / "none.3mf")
