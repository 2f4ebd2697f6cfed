"""The files that a maker needs in addition to the housing: drawing, coupon, cover, bracket, bill and sheet."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import cadquery as cq
import trimesh

from cad.drawing.housing_drawing import draw_housing_sheet
from cad.drawing.sheet import Title
from cad.fabrication.bill import bill_csv, bill_of_materials
from cad.fabrication.exploded import write_exploded
from cad.fabrication.fabrication_sheet import fabrication_sheet
from cad.fabrication.file_shapes import maker_parts
from cad.fabrication.print_bed import write_plate
from cad.fabrication.wiring import write_wiring
from cad.files.sensor_files import export_step, export_stl, print_shape, triangles_volume
from cad.files.slicer_settings import slicer_settings
from cad.files.stl import triangles
from cad.parts.assembly import assemble_sensor
from cad.parts.pose import print_pose
from cad.parts.sensor import SensorSolids
from sensor.design.processes import Process
from sensor.design.signal_path import SignalPath, SpringReadOut
from sensor.quantity import Estimate


@dataclass(frozen=True, kw_only=True)
class MakerFiles:
    """The paths of the written files, and the cover and the bracket as read back from their STEP files [mm]."""

    paths: tuple[Path, ...]
    cover: cq.Shape
    mount: cq.Shape


@dataclass(frozen=True, kw_only=True)
class _PartFiles:
    """The files of the printed parts, with the shapes, meshes and volumes of the parts, keyed by part name.

    `read_back` are the shapes [mm] that were read back from the STEP files. `meshes` are the parts in print pose [mm],
    and `volumes` [mm^3] are their volumes. Meshes and volumes include the housing, whose own files were written before.
    """

    paths: tuple[Path, ...]
    read_back: Mapping[str, cq.Shape]
    meshes: Mapping[str, trimesh.Trimesh]
    volumes: Mapping[str, Estimate]


def write_fabrication(sensor: SensorSolids, title: Title, read_out: SpringReadOut, folder: Path) -> MakerFiles:
    """Write the drawing, coupon, cover, bracket, print plate, exploded view, bill and sheet to a folder.

    `title` is the title block of the drawing, without the mass, and `read_out` describes how the springs are read. If
    `read_out` has a signal path, the wiring plan wiring.svg is written too. Raises OSError if a file cannot be written,
    and ExportError if the volume read back from a file is wrong.
    """
    process = title.process
    parts = {name: draw() for name, draw in maker_parts(sensor).items()}
    masses = _part_masses(sensor, parts, process)
    assembly = assemble_sensor(sensor)
    bill = bill_of_materials(sensor, assembly, process, masses, read_out.signal)

    deflections = [spring.deflection for spring in read_out.springs]
    drawing = draw_housing_sheet(sensor, replace(title, mass_g=masses["housing"]), deflections)
    drawing_paths = drawing.write(folder / "drawing")
    part_files = _write_parts(sensor, parts, folder)
    plate_path = folder / "plate.3mf"
    settings = slicer_settings(process, sensor.housing)
    plate_size = write_plate(part_files.meshes, part_files.volumes, bill, settings, plate_path)
    wiring_paths = _write_wiring(sensor, read_out.signal, folder)
    # The bracket is added only now, because the bill counts the parts of an assembly without the bracket.
    assembly_with_bracket = assembly.add(parts["mount"])
    exploded_path = folder / "exploded.svg"
    write_exploded(assembly_with_bracket, bill, exploded_path)
    sheet = fabrication_sheet(sensor, title, bill, read_out, plate_size)
    text_paths = _write_texts(folder, {"bom.csv": bill_csv(bill), "fabrication.md": sheet})
    return MakerFiles(
        paths=(*drawing_paths, *part_files.paths, plate_path, *wiring_paths, exploded_path, *text_paths),
        cover=part_files.read_back["cover"],
        mount=part_files.read_back["mount"],
    )


def _write_texts(folder: Path, texts: Mapping[str, str]) -> list[Path]:
    """Write texts to files in a folder, keyed by file name, and return their paths. Raises OSError if this fails."""
    paths = []
    for name, text in texts.items():
        path = folder / name
        path.write_text(text, encoding="utf-8")
        paths.append(path)
    return paths


def _part_masses(sensor: SensorSolids, parts: Mapping[str, cq.Assembly], process: Process) -> dict[str, float]:
    """Return the masses of the housing and of the other printed `parts` [g], keyed by part name.

    The parts are assumed to be solid, without voids of an infill.
    """
    shapes = {"housing": sensor.part.shape} | {name: part.shapes[0] for name, part in parts.items()}
    # The factor 1e-3 converts mm^3 to cm^3.
    return {name: 1e-3 * shape.Volume() * process.density_g_per_cm3 for name, shape in shapes.items()}


def _write_wiring(sensor: SensorSolids, signal: SignalPath | None, folder: Path) -> list[Path]:
    """Write the wiring plan wiring.svg for a signal path, and return its path. Without a signal path, write nothing.

    Raises OSError if the file cannot be written.
    """
    if signal is None:
        return []
    path = folder / "wiring.svg"
    write_wiring(path, sensor.tips.names, sensor.housing.plates, signal.board)
    return [path]


def _write_parts(sensor: SensorSolids, parts: Mapping[str, cq.Assembly], folder: Path) -> _PartFiles:
    """Write each part to a STEP file, and in print pose to an STL file.

    `parts` are the parts that are printed in addition to the housing, keyed by name. The result also holds the mesh and
    the volume of the housing, which the print plate needs. Raises OSError if a file cannot be written, and ExportError
    if the volume read back from it is wrong.
    """
    paths = []
    read_back = {}
    printed_housing = print_shape(sensor)  # in print pose, with its engraving
    meshes = {"housing": triangles(printed_housing)}
    volumes = {"housing": triangles_volume(printed_housing)}
    for name, part in parts.items():
        step = folder / f"{name}.step"
        stl = folder / f"{name}.stl"
        shape = part.shapes[0]
        read_back[name] = export_step(part, step)
        meshes[name] = export_stl(print_pose(shape), stl)
        volumes[name] = triangles_volume(shape)
        paths += [step, stl]
    return _PartFiles(paths=tuple(paths), read_back=read_back, meshes=meshes, volumes=volumes)
