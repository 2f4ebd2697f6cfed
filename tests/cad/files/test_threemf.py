import zipfile

import numpy as np
import pytest
import trimesh

from cad.checks.part_checks import check_file
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


def test_reader_finds_one_named_object_a_body_with_welded_corners(package):
    content = read_3mf(package)
    assert content.names == (SIGNS_OF_XML, "high")
    assert content.faults == ()
    assert content.mesh.volume == pytest.approx(6.0 + 8.0, rel=1e-6)
    mesh = content.mesh
    assert (mesh.body_count, mesh.is_watertight, len(mesh.vertices)) == (2, True, 16)


def test_same_meshes_give_the_same_bytes_of_the_given_day(tmp_path, monkeypatch):
    boxes = {"box": trimesh.creation.box((1.0, 2.0, 3.0))}
    written = []
    for seconds in ("0", "0", "1000000000"):
        monkeypatch.setenv("SOURCE_DATE_EPOCH", seconds)
        write_3mf(boxes, tmp_path / "box.3mf")
        written.append((tmp_path / "box.3mf").read_bytes())
    assert written[0] == written[1] != written[2]
    with zipfile.ZipFile(tmp_path / "box.3mf") as archive:
        assert {entry.date_time for entry in archive.infolist()} == {(2001, 9, 9, 1, 46, 40)}


def test_package_has_nothing_that_old_readers_do_not_know(package):
    """No 64-bit sizes in the archive, no prefix in the model: Slic3r 1.3 takes a package with 64-bit sizes as empty."""
    with zipfile.ZipFile(package) as archive:
        entries = archive.infolist()
        model = archive.read("3D/3dmodel.model").decode()
    assert [entry.extra for entry in entries] == [b"", b"", b""]
    assert max(entry.extract_version for entry in entries) == 20
    assert ("xmlns:" in model, "UUID" in model) == (False, False)


def test_folder_that_is_missing_is_an_error_of_the_system(tmp_path):
    with pytest.raises(OSError, match=r"none"):
        write_3mf({"box": trimesh.creation.box((1.0, 2.0, 3.0))}, tmp_path / "none" / "box.3mf")


@pytest.mark.parametrize(
    ("unit", "millimetres"),
    [("micron", 1e-3), ("centimeter", 10.0), ("inch", 25.4), ("foot", 304.8), ("meter", 1000.0)],
)
def test_unit_of_the_file_counts(package, unit, millimetres):
    rewrite(package, 'unit="millimeter"', f'unit="{unit}"')
    assert read_3mf(package).mesh.volume == pytest.approx(14.0 * millimetres**3, rel=1e-6)


IN_ITSELF = '<object id="3"><components><component objectid="3"/></components></object></resources>'


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('objectid="2"', 'objectid="3"'),
        ('v1="0"', 'v1="99"'),
        ('x="', 'x="nan'),
        ("<build>", ""),
        ('objectid="2"', 'objectid="2" transform="1 0 0"'),
        ("</resources>", IN_ITSELF),
    ],
)
def test_planted_fault_is_refused(package, old, new):
    rewrite(package, old, new)
    with pytest.raises(ValueError, match=package.name):
        read_3mf(package)


def test_package_without_triangles_is_refused(tmp_path):
    write_3mf({}, tmp_path / "none.3mf")
    with pytest.raises(ValueError, match=r"none\.3mf"):
        read_3mf(tmp_path / "none.3mf")


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 cut off", b"solid text\nendsolid\n"])
def test_what_is_no_package_is_refused(tmp_path, content):
    (tmp_path / "broken.3mf").write_bytes(content)
    with pytest.raises(ValueError, match=r"broken\.3mf"):
        read_3mf(tmp_path / "broken.3mf")


MOVED = 'transform="1 0 0 0 1 0 0 0 1 30 0 0"'
QUARTER_TURN = 'transform="0 1 0 -1 0 0 0 0 1 40 0 0"'
MIRRORED = 'transform="-1 0 0 0 1 0 0 0 1 0 0 0"'
TWO_LEVELS = (
    f'<object id="3"><components><component objectid="1"/><component objectid="1" {QUARTER_TURN}/></components>'
    f'</object></resources><build><item objectid="3" {MOVED}/>'
)
# What slicers write: a text, what takes its place, volume [mm^3], bounds along x [mm], whether it keeps the standard.
SHAPES = {
    "printable": ("<item ", '<item printable="1" ', 14.0, (-0.5, 6.0), True),
    "printable and another": ("<item ", '<item printable="1" printed="1" ', 14.0, (-0.5, 6.0), False),
    "components": ("</resources><build>", TWO_LEVELS, 26.0, (-0.5, 71.0), True),
    "mirrored": ('<item objectid="2"', f'<item objectid="2" {MIRRORED}', 14.0, (-6.0, 0.5), True),
    "support beside": ('name="high" type="model"', 'name="high" type="support"', 6.0, (-0.5, 0.5), True),
    "object without an item": ('<item objectid="2"/>', "", 6.0, (-0.5, 0.5), True),
    "unit that is none": ('unit="millimeter"', 'unit="parsec"', 14.0, (-0.5, 6.0), False),
}


@pytest.mark.parametrize("shape", SHAPES)
def test_file_of_a_slicer_is_read_and_only_its_strictness_is_judged_apart(package, shape):
    old, new, volume, along_x, is_strict = SHAPES[shape]
    rewrite(package, old, new)
    mesh = read_3mf(package).mesh
    assert mesh.volume == pytest.approx(volume, rel=1e-6)
    assert mesh.bounds[:, 0] == pytest.approx(along_x)
    verdicts = {verdict.name: verdict for verdict in check_file(package)}
    assert verdicts["geometry.3mf_strict"].passed is is_strict
    assert verdicts["geometry.volume"].value == pytest.approx(volume, rel=1e-6)


def test_corners_that_are_not_shared_are_merged_and_not_standard(tmp_path):
    box = trimesh.creation.box((1.0, 2.0, 3.0))
    write_3mf(
        {"box": trimesh.Trimesh(box.triangles.reshape(-1, 3), np.arange(36).reshape(12, 3), process=False)},
        tmp_path / "box.3mf",
    )
    content = read_3mf(tmp_path / "box.3mf")
    assert (content.mesh.is_watertight, len(content.mesh.vertices), len(content.faults)) == (True, 8, 1)
