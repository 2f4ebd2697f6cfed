"""A press as a series for ParaView: a VTU file for each travel, and a .pvd file that says which travel each is."""

import tempfile
from pathlib import Path

import numpy as np

from cad.parts.housing import Housing
from mesh.housing.sweep import flexure_mesh
from pipeline.making.fields import field_arrays
from pipeline.report.report import Report, ResponseReport, read_report
from pipeline.response.scene_press import scene_of
from pipeline.springs.mounts import attached_to
from pipeline.storage.files import refuse_taken, write_files
from pipeline.storage.vtu import write_vtu
from sensor.design.processes import Process
from sensor.quantity import validation_error
from solve.contact.fields import fruit_fields
from solve.contact.pressure import footprint_pressure
from solve.housing.clamped_half import clamped_half
from solve.housing.fields import fields_in
from solve.housing.stiffness import displacements

FLAG = "--pvd"
_KINDS = ("flexure", "fruit")
_COLLECTION = """<?xml version="1.0"?>
<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">
  <Collection>
{steps}  </Collection>
</VTKFile>
"""
_STEP = '    <DataSet timestep="{x:.9g}" group="" part="0" file="{kind}_{step:02d}.vtu"/>\n'


def write_series(folder: Path, target: Path, *, force: bool = False) -> list[Path]:
    """Write flexure.pvd and fruit.pvd with their VTU files over the travel at the largest modulus; return the paths.

    The time of a step is its travel [mm]. Raises InputError where the folder has no housing, springs or response. It
    does so too where the target cannot be written, or holds unmanaged files that `force` does not keep aside. Raises
    SolveError.
    """
    report = read_report(folder)
    housing = report.housing
    if housing is None:
        bound = "an output folder with a housing"
        raise validation_error("DIR", str(folder), "", bound, "run a design that can be made")
    if not report.response:
        bound = "an output folder with a response"
        raise validation_error("DIR", str(folder), "", bound, "press deeper or level")
    row = max(report.response, key=lambda row: row.E_MPa)
    names = [f"{kind}_{step:02d}.vtu" for kind in _KINDS for step in range(len(row.x_mm))]
    names += [f"{kind}.pvd" for kind in _KINDS]
    refuse_taken([target / name for name in names], FLAG, force=force, renew=True)
    with tempfile.TemporaryDirectory(prefix="twintip-") as unfinished:
        _write_housing(housing, report.design.process, row, Path(unfinished))
        _write_fruit(report, row, Path(unfinished))
        for kind in _KINDS:
            steps = [_STEP.format(x=x, kind=kind, step=step) for step, x in enumerate(row.x_mm)]
            text = _COLLECTION.format(steps="".join(steps))
            (Path(unfinished) / f"{kind}.pvd").write_text(text, encoding="utf-8")
        files = {target / name: (Path(unfinished) / name).read_bytes() for name in names}
    return write_files(files, FLAG, force=force, renew=True)


def _write_housing(housing: Housing, process: Process, row: ResponseReport, folder: Path) -> None:
    """Write the half housing y >= 0 [mm] under the forces of each travel; it is linear, so it is solved once."""
    mesh = flexure_mesh(housing)
    half = clamped_half(mesh, process.E_MPa, process.poisson, attached_to(housing))
    u_per_N = displacements(half)
    for step, forces in enumerate(zip(row.F_l_N, row.F_h_N, strict=True)):
        u = u_per_N @ np.array([force or 0.0 for force in forces])  # None: the tip is off the fruit
        fields = fields_in(mesh, half.material, u)
        write_vtu(folder / f"flexure_{step:02d}.vtu", mesh, field_arrays(fields), half_at_y=0.0)


def _write_fruit(report: Report, row: ResponseReport, folder: Path) -> None:
    """Write the fruit's block [mm] under the pressure of each travel, the sensor level but for the design's tilt."""
    spring_compliance = np.array(report.read_out.springs_mm_per_N)
    for step, x in enumerate(row.x_mm):
        pressure = footprint_pressure(scene_of(report.design), report.compliance, spring_compliance, row.E_MPa, x)
        mesh, fields = fruit_fields(report.design.fruit, pressure)
        write_vtu(folder / f"fruit_{step:02d}.vtu", mesh, field_arrays(fields))
