"""STEP files of other programs: what holds no solid, several solids, or another unit."""

import cadquery as cq
import OCP
import pytest

from cad.checks.part_checks import check_file

SIZE = (20.0, 10.0, 5.0)
VOLUME = SIZE[0] * SIZE[1] * SIZE[2]
BOX = cq.Solid.makeBox(*SIZE)
BESIDE = BOX.translate(cq.Vector(30.0, 0.0, 0.0))
HOLLOW = BOX.cut(cq.Solid.makeBox(10.0, 4.0, 2.0, cq.Vector(5.0, 3.0, 1.5)))
UNITS = {"MM": "SI_UNIT(.MILLI.,.METRE.)", "M": "SI_UNIT($,.METRE.)", "INCH": "'INCH'"}  # as Part 21 writes them


def verdicts_of(shape, path, unit="MM"):
    """Write a shape [mm] as STEP in a unit, and return the verdicts on the file by name."""
    writer = OCP.STEPControl.STEPControl_Writer()  # first: the unit can be set once there is one
    assert OCP.Interface.Interface_Static.SetCVal_s("write.step.unit", unit)
    writer.Transfer(shape.wrapped, OCP.STEPControl.STEPControl_AsIs)
    writer.Write(str(path))
    assert OCP.Interface.Interface_Static.SetCVal_s("write.step.unit", "MM")
    assert UNITS[unit] in path.read_text()
    return {verdict.name.removeprefix("geometry."): verdict for verdict in check_file(path)}


@pytest.mark.parametrize(
    "shape", [BOX.Wires()[0], cq.Compound.makeCompound(BOX.Edges()), cq.Vertex.makeVertex(1.0, 2.0, 3.0)]
)
def test_step_without_a_face_is_one_failed_verdict_that_names_it(tmp_path, shape):
    verdicts = verdicts_of(shape, tmp_path / "wire.step")
    assert set(verdicts) == {"readable"}
    assert verdicts["readable"].passed is False
    assert "wire.step" in verdicts["readable"].reference


@pytest.mark.parametrize("unit", ["M", "INCH", "MM"])
def test_unit_of_a_step_counts(tmp_path, unit):
    verdicts = verdicts_of(BOX, tmp_path / "box.step", unit)
    assert verdicts["units"].value == pytest.approx(SIZE[0])
    assert verdicts["volume"].value == pytest.approx(VOLUME)
    assert all(verdict.passed for verdict in verdicts.values())


@pytest.mark.parametrize(
    ("shape", "solids", "open_edges", "volume"),
    [
        (BOX.Shells()[0], 0, 0, VOLUME),
        (cq.Shell.makeShell(BOX.Faces()[:5]), 0, 4, None),
        (cq.Compound.makeCompound([BOX, BESIDE]), 2, 0, 2.0 * VOLUME),
        (cq.Compound.makeCompound([BOX, *BESIDE.Edges()]), 1, 0, VOLUME),
        (HOLLOW, 1, 0, VOLUME - 10.0 * 4.0 * 2.0),
    ],
)
def test_solids_of_a_step_are_counted(tmp_path, shape, solids, open_edges, volume):
    verdicts = verdicts_of(shape, tmp_path / "part.step")
    assert (verdicts["one_solid"].value, verdicts["one_solid"].passed) == (solids, solids == 1)
    assert verdicts["watertight"].value == open_edges
    if volume is not None:
        assert verdicts["volume"].value == pytest.approx(volume, rel=1e-6)
