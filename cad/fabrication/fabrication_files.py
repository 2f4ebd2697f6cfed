"""What a maker needs beside the part: drawings, coupon, cover, bracket, bill of materials and sheet."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cadquery as cq

from cad.design.processes import Process
from cad.drawing.coupon_drawing import coupon_drawing
from cad.drawing.cover_drawing import cover_drawing
from cad.drawing.housing_drawing import housing_drawing
from cad.drawing.sheet import Sheet, Title
from cad.fabrication.bill import bill_csv, bill_of_materials
from cad.fabrication.bridges import Spring, bridges
from cad.fabrication.fabrication_sheet import SheetFacts, fabrication_sheet
from cad.fabrication.mount import mount_solid
from cad.files.sensor_files import export_step, export_stl
from cad.parts.assembly import COVER_COLOUR
from cad.parts.coupon import coupon_of
from cad.parts.coupon_solid import coupon_part
from cad.parts.cover_solid import cover_of, cover_part
from cad.parts.part import Part
from cad.parts.pose import print_pose
from cad.parts.sensor import STEEL_COLOUR, Body, Colour, Sensor

_COUPON_COLOUR = (0.45, 0.62, 0.35)


@dataclass(frozen=True, kw_only=True)
class MakerFiles:
    """The paths that were written, and cover and bracket as their STEP files hold them [mm]."""

    paths: tuple[Path, ...]
    cover: cq.Shape
    mount: cq.Shape


def write_fabrication(sensor: Sensor, title: Title, springs: Sequence[Spring], folder: Path) -> MakerFiles:
    """Write drawings, coupon, cover, bracket, bom.csv and fabrication.md; return what was written.

    Raises OSError when a file cannot be written, ExportError when one read back has another volume.
    """
    coupon, cover = coupon_part(coupon_of(sensor.housing)), cover_part(cover_of(sensor))
    drawings = [path for name, sheet in _sheets(sensor, title, coupon, cover) for path in sheet.write(folder / name)]
    of_coupon, _ = _write_solid(coupon.shape, folder / "coupon", _COUPON_COLOUR)
    of_cover, cover_read = _write_solid(cover.shape, folder / "cover", COVER_COLOUR)
    bracket = mount_solid(sensor)
    of_mount, mount_read = _write_solid(bracket, folder / "mount", STEEL_COLOUR)
    shapes = {"housing": sensor.part.shape, "cover": cover.shape, "coupon": coupon.shape, "mount": bracket}
    facts = _facts(sensor, title, springs, _masses(shapes, title.process))
    sheet = fabrication_sheet(sensor, title, facts)
    texts = _write_texts({"bom.csv": bill_csv(facts.bill), "fabrication.md": sheet}, folder)
    return MakerFiles(paths=(*drawings, *of_coupon, *of_cover, *of_mount, *texts), cover=cover_read, mount=mount_read)


def _facts(sensor: Sensor, title: Title, springs: Sequence[Spring], masses: dict[str, float]) -> SheetFacts:
    """Return bill and read-out for parts of these masses [g]."""
    wired = bridges(springs, sensor.housing, title.process)
    bill = bill_of_materials(sensor, title.process, wired, masses)
    return SheetFacts(bill=bill, bridges=wired)


def _masses(shapes: Mapping[str, cq.Shape], process: Process) -> dict[str, float]:
    """Return by name the mass of solid parts [g]."""
    return {name: 1e-3 * shape.Volume() * process.density_g_per_cm3 for name, shape in shapes.items()}


def _write_texts(texts: Mapping[str, str], folder: Path) -> tuple[Path, ...]:
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    return tuple(folder / name for name in texts)


def _sheets(sensor: Sensor, title: Title, coupon: Part, cover: Part) -> Iterator[tuple[str, Sheet]]:
    """Yield the drawings by the names of their files."""
    yield "drawing", housing_drawing(sensor.part, sensor.housing, title)
    yield "drawing-coupon", coupon_drawing(coupon, coupon_of(sensor.housing), replace(title, part="coupon"))
    yield "drawing-cover", cover_drawing(cover, cover_of(sensor), replace(title, part="cover, make two"))


def _write_solid(solid: cq.Shape, path: Path, colour: Colour) -> tuple[tuple[Path, Path], cq.Shape]:
    """Write a solid [mm] as STEP, and as STL in print pose; return their paths and what the STEP file holds."""
    step, stl = path.with_suffix(".step"), path.with_suffix(".stl")
    made = export_step((Body(name=path.name, shape=solid, colour=colour),), step)
    export_stl(print_pose(solid), stl)
    return (step, stl), made
