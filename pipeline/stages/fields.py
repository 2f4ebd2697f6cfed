"""Meshes and fields as VTU files: the housing under its forces at full travel, the fruit under the tips."""

from collections.abc import Sequence
from pathlib import Path

from cad.design.parameters import Design
from cad.quantity import InputError
from mesh.housing.sweep import flexure_mesh
from pipeline.fit.mounts import attached_to
from pipeline.options import RunOptions
from pipeline.stages.response import ScenePress, scene_of
from pipeline.stages.springs import FittedSprings
from pipeline.storage.vtu import write_mesh, write_vtu
from solve.contact.fields import fruit_fields
from solve.contact.pressure import footprint_pressure
from solve.fruit.compliance import FruitCompliance
from solve.housing.fields import flexure_fields


def write_fields(
    design: Design,
    contact: FruitCompliance,
    springs: FittedSprings,
    press: ScenePress,
    options: RunOptions,
    folder: Path,
) -> str | None:
    """Write flexure.vtu, the mesh of the half housing y >= 0 [mm]; with `options.fields` its fields, and fruit.vtu.

    Fields are displacement [mm] and stress [MPa] of the hardest press. Returns why fruit.vtu is left out, if it is.
    Raises SolveError.
    """
    if not options.fields:
        if springs.housing is not None:
            write_mesh(folder / "flexure.vtu", flexure_mesh(springs.housing))
        return None
    hardest = press.hardest
    _write_flexure(springs, hardest.F[-1, -1].tolist(), folder)
    E = float(hardest.E[-1])
    try:
        pressure = footprint_pressure(scene_of(design), contact, springs.C, E, design.press.travel_mm)
    except InputError as error:
        return f"fruit.vtu is left out: {error}"
    fruit = fruit_fields(design.fruit, pressure)
    write_vtu(
        folder / "fruit.vtu",
        fruit.mesh,
        {"displacement_mm": fruit.displacement},
        {"von_mises_MPa": fruit.von_mises},
    )
    return None


def _write_flexure(springs: FittedSprings, forces: Sequence[float], folder: Path) -> None:
    if springs.housing is None:
        return
    mesh, process = flexure_mesh(springs.housing), springs.process
    loaded = flexure_fields(mesh, process.E_MPa, process.poisson, forces, attached_to(springs.housing))
    write_vtu(
        folder / "flexure.vtu",
        mesh,
        {"displacement_mm": loaded.displacement},
        {"von_mises_MPa": loaded.von_mises},
    )
