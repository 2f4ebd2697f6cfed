"""Meshes and fields of a run as VTU files: the housing under its forces at full travel, the fruit under the tips."""

from pathlib import Path

from cad.quantity import InputError
from mesh.housing.sweep import flexure_mesh
from pipeline.fit.foils import bonded_foils
from pipeline.stages.springs import PrintedSprings
from pipeline.stages.verdicts import Case
from pipeline.storage.vtu import write_fields, write_mesh
from solve.contact.fields import fruit_fields
from solve.contact.pressure import footprint_pressure
from solve.contact.scene import Scene
from solve.housing.fields import flexure_fields


def write_solutions(case: Case, printed: PrintedSprings, folder: Path, *, fields: bool) -> str | None:
    """Write flexure.vtu, the mesh of the half housing y >= 0; with `fields` its displacement and stress, and fruit.vtu.

    Fields are at the largest modulus and full travel. Returns why fruit.vtu is left out, if it is. Raises SolveError.
    """
    if not fields:
        if printed.housing is not None:
            write_mesh(folder / "flexure.vtu", flexure_mesh(printed.housing))
        return None
    response = case.hardest(printed.compliance).responses[0]
    _write_flexure(printed, (float(response.F_l[-1]), float(response.F_h[-1])), folder)
    design = case.design
    scene = Scene(fruit=design.fruit, tips=design.tips, press=design.press)
    try:
        pressure = footprint_pressure(scene, case.contact, printed.compliance, response.E, design.press.travel_mm)
    except InputError as error:
        return f"fruit.vtu is left out: {error}"
    fruit = fruit_fields(design.fruit, pressure)
    write_fields(
        folder / "fruit.vtu",
        fruit.mesh,
        {"displacement_mm": fruit.displacement},
        {"von_mises_MPa": fruit.von_mises},
    )
    return None


def _write_flexure(printed: PrintedSprings, forces: tuple[float, float], folder: Path) -> None:
    if printed.housing is None:
        return
    mesh, process = flexure_mesh(printed.housing), printed.process
    found = flexure_fields(mesh, process.E_MPa, process.poisson, forces, bonded_foils(printed.housing))
    write_fields(
        folder / "flexure.vtu",
        mesh,
        {"displacement_mm": found.displacement},
        {"von_mises_MPa": found.von_mises},
    )
