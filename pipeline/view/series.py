"""A press as a series for ParaView: a VTU file for each travel, and a .pvd file that says which travel each is."""

import tempfile
from pathlib import Path

from pipeline.report.stored import StoredReport, read_report
from pipeline.storage.placed_files import place_files, refuse_taken
from pipeline.storage.vtu import write_vtu
from pipeline.view.loaded_sensor import forces_at, fruit_under, housing_of

FLAG = "--pvd"
_HEAD = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">\n  <Collection>\n'
_TAIL = "  </Collection>\n</VTKFile>\n"


def write_series(folder: Path, target: Path, *, force: bool = False) -> list[Path]:
    """Write flexure.pvd and fruit.pvd with their VTU files over the travel at the largest modulus; return the paths.

    The time of a step is its travel [mm]. The same folder gives the same bytes. Raises InputError where the folder has
    no housing or response, the target cannot be written, or holds foreign files that `force` does not keep aside.
    """
    report = read_report(folder)
    travels = _travels(report)
    names = [f"{kind}_{step:02d}.vtu" for kind in ("flexure", "fruit") for step in range(len(travels))]
    names += ["flexure.pvd", "fruit.pvd"]
    if not force:
        refuse_taken(target, names, FLAG)
    with tempfile.TemporaryDirectory(prefix="twintip-") as unfinished:
        _write_steps(report, folder, travels, Path(unfinished))
        files = {name: (Path(unfinished) / name).read_bytes() for name in names}
    return place_files(target, files, FLAG, force=force)


def _travels(report: StoredReport) -> tuple[float, ...]:
    """Return the travels of the response [mm]."""
    return report.response[-1].x_mm if report.response else ()


def _write_steps(report: StoredReport, folder: Path, travels: tuple[float, ...], unfinished: Path) -> None:
    """Write the files of each travel of a report, which is that of a folder, into an unfinished folder."""
    E = max(row.E_MPa for row in report.response)
    housing = housing_of(report, folder)
    for step, x in enumerate(travels):
        forces = forces_at(report.response, E, x)
        write_vtu(unfinished / f"flexure_{step:02d}.vtu", housing.mesh, housing.under(forces))
        mesh, arrays = fruit_under(report, folder, E, x)
        write_vtu(unfinished / f"fruit_{step:02d}.vtu", mesh, arrays)
    for kind in ("flexure", "fruit"):
        (unfinished / f"{kind}.pvd").write_text(_collection(kind, travels), encoding="utf-8")


def _collection(kind: str, travels: tuple[float, ...]) -> str:
    """Return the text of a .pvd file, whose time is the travel [mm]."""
    steps = "".join(
        f'    <DataSet timestep="{x:.9g}" group="" part="0" file="{kind}_{step:02d}.vtu"/>\n'
        for step, x in enumerate(travels)
    )
    return _HEAD + steps + _TAIL
