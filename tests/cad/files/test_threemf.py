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


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('objectid="2"', 'objectid="3"'),
        ('v1="0"', 'v1="99"'),
        ('x="', 'x="nan'),
        ('x="', 'x="wide'),
        ("<build>", ""),
        ('objectid="2"', 'objectid="2" transform="1 0 0"'),
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


# A box of 20 x 10 x 5 mm, and what makers of slicers put around it. What each shape must hold follows from its text.
SIZE = np.array([20.0, 10.0, 5.0])
VOLUME = float(SIZE.prod())
CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
MATERIAL = 'xmlns:m="http://schemas.microsoft.com/3dmanufacturing/material/2015/02"'
PRODUCTION = 'xmlns:p="http://schemas.microsoft.com/3dmanufacturing/production/2015/06"'
SLICE = 'xmlns:s="http://schemas.microsoft.com/3dmanufacturing/slice/2015/07"'
RELATIONS = "http://schemas.openxmlformats.org/package/2006/relationships"
MODEL_TYPE = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"
CORNERS = [(x, y, z) for x in (0.0, SIZE[0]) for y in (0.0, SIZE[1]) for z in (0.0, SIZE[2])]
FACES = trimesh.Trimesh(CORNERS, trimesh.creation.box(SIZE).faces, process=False).faces.tolist()
ITEM = '<item objectid="1"/>'
MOVED = "1 0 0 0 1 0 0 0 1 30 0 0"
QUARTER_TURN = "0 1 0 -1 0 0 0 0 1 40 0 0"
MIRRORED = "-1 0 0 0 1 0 0 0 1 20 0 0"


def mesh_text(corners=CORNERS, faces=FACES, on_triangle=""):
    vertices = "".join('<vertex x="{}" y="{}" z="{}"/>'.format(*corner) for corner in corners)
    triangles = "".join('<triangle v1="{}" v2="{}" v3="{}"{}/>'.format(*face, on_triangle) for face in faces)
    return f"<mesh><vertices>{vertices}</vertices><triangles>{triangles}</triangles></mesh>"


def object_text(number, content, more=""):
    return f'<object id="{number}"{more}>{content}</object>'


def component_text(*uses):
    return "<components>" + "".join(f"<component {use}/>" for use in uses) + "</components>"


def model_text(objects, build=ITEM, head='unit="millimeter"', metadata=""):
    body = f"{metadata}<resources>{objects}</resources><build>{build}</build>"
    return f'<?xml version="1.0" encoding="UTF-8"?>\n<model {head} xmlns="{CORE}">{body}</model>'


def relations_text(target):
    return (
        f'<?xml version="1.0" encoding="UTF-8"?><Relationships xmlns="{RELATIONS}">'
        f'<Relationship Target="{target}" Id="rel-1" Type="{MODEL_TYPE}"/></Relationships>'
    )


def write_package(path, model, **more):
    """Write a package with this root model and further parts by name."""
    types = (
        '<?xml version="1.0" encoding="UTF-8"?>'
        '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
        '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
        '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>'
    )
    parts = {
        "[Content_Types].xml": types, "_rels/.rels": relations_text("/3D/3dmodel.model"), "3D/3dmodel.model": model,
    }  # fmt: skip
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as package:
        for name, text in {**parts, **more}.items():
            package.writestr(name, text)


BOX = object_text(1, mesh_text())
TWO_LEVELS = object_text(2, component_text('objectid="1"', f'objectid="1" transform="{QUARTER_TURN}"'))
FOREIGN = (
    "<m:colorgroup id='5'><m:color color='#FF0000FF'/></m:colorgroup>"
    "<basematerials id='6'><base name='PLA' displaycolor='#FFFFFF'/></basematerials>"
)
STACK = (
    '<s:slicestack id="9"><s:slice ztop="1"><s:vertices><s:vertex x="0" y="0"/><s:vertex x="1" y="0"/>'
    '<s:vertex x="0" y="1"/></s:vertices><s:polygon startv="0"><s:segment v2="1"/><s:segment v2="2"/>'
    '<s:segment v2="0"/></s:polygon></s:slice></s:slicestack>'
)
SHAPES = {  # name: model, number of bodies, size [mm] of all of them, whether it keeps the standard
    "plain": (model_text(BOX), 1, SIZE, True),
    "printable": (model_text(BOX, '<item objectid="1" printable="1"/>'), 1, SIZE, True),
    "two printable": (
        model_text(BOX, f'<item objectid="1" printable="1"/><item objectid="1" printable="1" transform="{MOVED}"/>'),
        2, (50.0, 10.0, 5.0), True,
    ),
    "another attribute": (model_text(BOX, '<item objectid="1" printed="1"/>'), 1, SIZE, False),
    "printable and another": (model_text(BOX, '<item objectid="1" printable="1" printed="1"/>'), 1, SIZE, False),
    "no unit": (model_text(BOX, head=""), 1, SIZE, True),
    "two items": (model_text(BOX, f'{ITEM}<item objectid="1" transform="{MOVED}"/>'), 2, (50.0, 10.0, 5.0), True),
    "components": (
        model_text(BOX + TWO_LEVELS, f'<item objectid="2" transform="{MOVED}"/>'), 2, (40.0, 20.0, 5.0), True,
    ),
    "mirrored": (model_text(BOX, f'<item objectid="1" transform="{MIRRORED}"/>'), 1, SIZE, True),
    "support beside": (
        model_text(BOX + object_text(3, mesh_text(), ' type="support"'), f'{ITEM}<item objectid="3"/>'), 1, SIZE, True,
    ),
    "object without an item": (model_text(BOX + object_text(3, mesh_text())), 1, SIZE, True),
    "metadata": (
        model_text(
            BOX,
            head='xmlns:slic3rpe="http://schemas.slic3r.org/3mf/2017/06"',
            metadata='<metadata name="slic3rpe:Version3mf">1</metadata><metadata name="Title">a</metadata>',
        ), 1, SIZE, True,
    ),
    "metadata twice": (
        model_text(BOX, metadata='<metadata name="Title">a</metadata><metadata name="Title">b</metadata>'),
        1, SIZE, False,
    ),
    "colours": (
        model_text(FOREIGN + object_text(1, mesh_text(on_triangle=' pid="5" p1="0"'), ' pid="5" pindex="0"'),
                   head=MATERIAL), 1, SIZE, True,
    ),
    "colours that are missing": (model_text(object_text(1, mesh_text(on_triangle=' pid="5" p1="0"'))), 1, SIZE, False),
    "painted": (model_text(object_text(1, mesh_text(on_triangle=' paint_color="4"'))), 1, SIZE, False),
    "unknown extension": (
        model_text(BOX, head='xmlns:z="http://example.com/2030" requiredextensions="z"'), 1, SIZE, False,
    ),
    "slices": (model_text(STACK + BOX, head=f'{SLICE} requiredextensions="s"'), 1, SIZE, True),
    "corners not shared": (
        model_text(object_text(1, mesh_text([CORNERS[i] for face in FACES for i in face],
                                            np.arange(36).reshape(12, 3).tolist()))), 1, SIZE, False,
    ),
    "unit that is none": (model_text(BOX, head='unit="parsec"'), 1, SIZE, False),
}  # fmt: skip
REFUSED = {  # by lib3mf, as the standard has it; slicers take some of these
    "component before its object": model_text(TWO_LEVELS + BOX, '<item objectid="2"/>'),
    "component within itself": model_text(object_text(1, component_text('objectid="1"'))),
    "prefix that is not declared": model_text(object_text(1, mesh_text(on_triangle=' slic3rpe:custom_seam="4"'))),
    "extension that is not declared": model_text(BOX, head='requiredextensions="z"'),
    "triangle of one edge": model_text(object_text(1, mesh_text(faces=[*FACES, (0, 0, 1)]))),
    "cut off": model_text(BOX)[:-30],
}


@pytest.mark.parametrize("shape", SHAPES)
def test_file_of_a_slicer_is_read_and_only_its_strictness_is_judged_apart(tmp_path, shape):
    model, bodies, size, is_strict = SHAPES[shape]
    path = tmp_path / "slicer.3mf"
    write_package(path, model, **{"Metadata/thumbnail.png": "no picture", "Metadata/Slic3r_PE.config": "; none"})
    content = read_3mf(path)
    assert content.mesh.extents == pytest.approx(size)
    assert content.mesh.volume == pytest.approx(bodies * VOLUME)
    verdicts = {verdict.name: verdict for verdict in check_file(path)}
    assert verdicts["geometry.3mf_strict"].passed is is_strict
    assert verdicts["geometry.one_solid"].value == bodies
    assert verdicts["geometry.volume"].value == pytest.approx(bodies * VOLUME)


@pytest.mark.parametrize("shape", REFUSED)
def test_file_that_the_library_refuses_is_named(tmp_path, shape):
    write_package(tmp_path / "refused.3mf", REFUSED[shape])
    with pytest.raises(ValueError, match=r"refused\.3mf"):
        read_3mf(tmp_path / "refused.3mf")


def test_production_extension_names_other_models(tmp_path):
    use = f'p:path="/3D/Objects/object_1.model" objectid="1" transform="{MOVED}"'
    root = model_text(
        object_text(2, component_text(use)),
        f'<item objectid="2" transform="{MOVED}"/>',
        head=f'unit="millimeter" {PRODUCTION} requiredextensions="p"',
    )
    parts = {
        "3D/Objects/object_1.model": model_text(BOX, ""),
        "3D/_rels/3dmodel.model.rels": relations_text("/3D/Objects/object_1.model"),
    }
    write_package(tmp_path / "bambu.3mf", root, **parts)
    content = read_3mf(tmp_path / "bambu.3mf")
    assert content.mesh.bounds[0] == pytest.approx((60.0, 0.0, 0.0))
    assert content.mesh.extents == pytest.approx(SIZE)
