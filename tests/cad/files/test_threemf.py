import zipfile

import pytest
import trimesh

from cad.files.threemf import read_3mf, write_3mf

SIGNS_OF_XML = 'low <L> & "co" it\'s &#x27;'


@pytest.fixture
def package(tmp_path):
    """Return a 3MF file of two boxes of 6 and 8 mm^3."""
    boxes = {
        SIGNS_OF_XML: trimesh.creation.box((1.0, 2.0, 3.0)),
        "high": trimesh.creation.box((2.0, 2.0, 2.0)).apply_translation((5.0, 0.0, 0.0)),
    }
    write_3mf(boxes, tmp_path / "two.3mf")
    return tmp_path / "two.3mf"


def rewrite(path, old, new):
    with zipfile.ZipFile(path) as package:
        parts = {name: package.read(name).decode() for name in package.namelist()}
    assert any(old in text for text in parts.values())
    with zipfile.ZipFile(path, "w") as package:
        for name, text in parts.items():
            package.writestr(name, text.replace(old, new))


def test_strict_reader_finds_one_named_object_a_body_with_welded_corners(package):
    content = read_3mf(package)
    assert content.names == (SIGNS_OF_XML, "high")
    assert content.warnings == ()
    assert content.mesh.volume == pytest.approx(6.0 + 8.0, rel=1e-6)
    mesh = content.mesh
    assert (mesh.body_count, mesh.is_watertight, len(mesh.vertices)) == (2, True, 16)


def test_unit_of_the_file_counts(package):
    rewrite(package, 'unit="millimeter"', 'unit="inch"')
    assert read_3mf(package).mesh.volume == pytest.approx(14.0 * 25.4**3, rel=1e-6)


@pytest.mark.parametrize(
    ("old", "new"), [('objectid="2"', 'objectid="3"'), ('v1="0"', 'v1="99"'), ('unit="millimeter"', 'unit="parsec"')]
)
def test_planted_fault_is_refused(package, old, new):
    rewrite(package, old, new)
    with pytest.raises(ValueError, match=package.name):
        read_3mf(package)


def test_package_without_triangles_is_refused(tmp_path):
    write_3mf({}, tmp_path / "none.3mf")
    with pytest.raises(ValueError, match=r"none\.3mf"):
        read_3mf(tmp_path / "none.3mf")
