"""A stand-in for an output folder to look at, which takes no solving."""

import json
from pathlib import Path

import numpy as np
import pyvista as pv
from skfem import MeshHex1
from stand_ins import result_of

from pipeline.report.outputs import write_outputs
from pipeline.storage.digests import with_digest
from pipeline.storage.vtu import write_vtu

LENGTH, DEPTH = 10.0, 1.0


def plate() -> pv.PolyData:
    """Return a plate with two tips of 1 mm, 8 mm apart, at its low end in y, flat on z = 0."""
    body = pv.Box((-12.0, 14.0, 3.0, 12.0, 0.0, 5.0)).triangulate()
    tips = [pv.Box((x - 0.5, x + 0.5, 0.0, 3.0, 2.0, 3.0)).triangulate() for x in (-4.0, 4.0)]
    return body.merge(tips)


def write_output_folder(folder: Path, **changes: object) -> Path:
    """Write a folder with a picture of each kind, its report with other entries."""
    folder.mkdir(parents=True)
    write_outputs(result_of(), folder)
    change_report(folder, **changes)
    plate().save(folder / "housing.stl")
    half = half_beam()
    write_vtu(folder / "flexure.vtu", half, beam_fields(half))
    fruit = MeshHex1.init_tensor(np.linspace(-10, 10, 11), np.linspace(-10, 10, 11), np.linspace(-12, 0, 7))
    write_vtu(folder / "fruit.vtu", fruit, beam_fields(fruit))
    return folder


def half_beam() -> MeshHex1:
    """Return the half y >= 0 of a beam [mm] whose ends are the tips of the two springs."""
    x = np.linspace(-0.5 * LENGTH, 0.5 * LENGTH, 11)
    mesh = MeshHex1.init_tensor(x, np.linspace(0, DEPTH, 3), np.linspace(0, 1, 3))
    return mesh.with_boundaries(
        {
            "low_tip": lambda x: x[0] == -0.5 * LENGTH,
            "high_tip": lambda x: x[0] == 0.5 * LENGTH,
            "symmetry": lambda x: x[1] == 0.0,
        }
    )


def beam_fields(mesh: MeshHex1) -> dict[str, np.ndarray]:
    """Return fields that grow with the distance from the middle, twice as much on the side of the high tip."""
    x, y, _ = mesh.p
    size = np.where(x < 0.0, -x, 2.0 * x)
    zero = np.zeros_like(x)
    return {
        "displacement_mm": np.stack([zero, 1e-3 * y * size, 1e-2 * size], axis=1),
        "von_mises_MPa": size,
        "largest_principal_strain": 1e-4 * size,
        "stress_MPa": np.stack([size, zero, -size, y * size, y * size, size], axis=1),
    }


def change_report(folder: Path, **changes: object) -> None:
    path = folder / "report.json"
    report = json.loads(path.read_text(encoding="utf-8"))
    path.write_text(json.dumps(with_digest({**report, **changes})), encoding="utf-8")
