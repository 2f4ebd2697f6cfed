"""Every process that can make the default sensor: fitted leaves, FE against its targets, CalculiX on the same mesh.

Run as a script from the root of the repository: `python tests/bench/processes.py [--tets] [--only NAME ...]
[--out docs]`, one thread: OMP_NUM_THREADS=1. `--tets` adds the extrapolation from curved tetrahedra on the STEP file
read back (minutes and gigabytes). It writes process-springs.md into a folder, prints it, and exits 1 when a goal is
missed.
"""

import argparse
import sys
import tempfile
from collections.abc import Sequence
from functools import partial
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from bench.beam_guess import beam_guess  # noqa: E402
from reference.flexure_reference import ReferenceStiffness, reference_stiffness  # noqa: E402
from reference.tetrahedra import fine_boxes, tetrahedra  # noqa: E402

from cad.design.parameters import Design, Print  # noqa: E402
from cad.design.processes import PROCESSES, Process  # noqa: E402
from cad.files.step import read_step, write_step  # noqa: E402
from cad.parts.housing import Housing  # noqa: E402
from cad.parts.housing_solid import housing_part, named_housing  # noqa: E402
from cad.parts.sensor import Body  # noqa: E402
from cad.quantity import InputError  # noqa: E402
from mesh.housing.sweep import flexure_mesh  # noqa: E402
from mesh.session import MeshError  # noqa: E402
from pipeline.bench.bench import OUT  # noqa: E402
from pipeline.bench.calculix import is_installed  # noqa: E402
from pipeline.bench.flexure import peer_stiffness  # noqa: E402
from pipeline.bench.harness import timed  # noqa: E402
from pipeline.bench.table import Sheet, page, percent, publish, signed_percent  # noqa: E402
from pipeline.springs.leaf_lengths import fit_lengths  # noqa: E402
from solve.housing.stiffness import tip_compliance  # noqa: E402

TARGET, SAME_MESH, CHECK = 1e-3, 1e-4, 3e-3  # goals, relative: FE to target, CalculiX to FE, extrapolated tets to FE
LOOP = 6.0  # goal: the whole fit over one mesh, assembly and solve of the final housing
# Relative sizes of the curved tetrahedra: the longer leaves of a stiff material need smaller ones.
TET_SIZES, STIFF_TET_SIZES, STIFF_MPA = (1.2, 0.9), (0.95, 0.75), 2e4
CHOICE, KIND = "hex 20, reduced", "C3D20R"
HEADS = (
    "process", "target N/m", "L mm", "FE N/m", "against target", "error bar", "CalculiX - FE", "tets - FE, spread",
    "fit CPU s", "x one mesh + solve",
)  # fmt: skip
INTRODUCTION = """\
`tests/bench/processes.py{flags}` writes this table: the springs of the default design for every process that can make
them. Each stiffness, in the mount that the design asks for, is compared with its target. CalculiX on the same mesh,
and where asked for quadratic tetrahedra on the exported STEP file, extrapolated from two meshes with their spread,
clamp the frame at its holes: they are compared with our own solve clamped there too. A fit finds both springs."""


def checked(housing: Housing, process: Process, sizes: Sequence[float]) -> ReferenceStiffness:
    """Return the stiffness that curved tetrahedra find on the housing's STEP file, extrapolated."""
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "housing.step"
        shape = housing_part(housing).shape
        write_step([Body(name="housing", shape=shape, colour=(0.5, 0.5, 0.5))], path, "housing")
        part = named_housing(read_step(path), housing)
    meshes = [tetrahedra(part, fine_boxes(housing, size), size) for size in sizes]
    return reference_stiffness(meshes, sizes, process.E_MPa, process.poisson)


def rows(process: Process, with_tets: bool) -> tuple[list[tuple[str, ...]], bool]:
    """Return the rows of both springs of a process, and whether they meet every goal that was looked at."""
    guess, targets = beam_guess(Design(print=Print(process=process.name)))
    material = (process.E_MPa, process.poisson)
    fitted, cost = timed(partial(fit_lengths, guess, targets, *material))
    found, housing = fitted.stiffness, fitted.housing
    mesh, meshing = timed(partial(flexure_mesh, housing))
    by_its_holes, solving = timed(partial(tip_compliance, mesh, *material))
    loop = cost / (meshing + solving)
    peer = peer_stiffness(mesh, (CHOICE, KIND), material)[0] if is_installed() else None
    sizes = STIFF_TET_SIZES if process.E_MPa > STIFF_MPA else TET_SIZES
    tets = checked(housing, process, sizes) if with_tets else None
    lines, good = [], loop <= LOOP
    for i, arm in enumerate(housing.arms):
        miss, line = found.K[i] / targets[i] - 1.0, ["-", "-"]
        good &= abs(miss) <= TARGET
        if peer is not None:
            apart = peer[i] / by_its_holes.K[i] - 1.0
            good &= abs(apart) <= SAME_MESH
            line[0] = signed_percent(apart)
        if tets is not None:
            apart = tets.K[i] / by_its_holes.K[i] - 1.0
            good &= abs(apart) <= CHECK
            line[1] = f"{signed_percent(apart)}, {tets.spread_percent[i]:.2g} %"
        target, K = (f"{1e3 * value:.6g}" for value in (targets[i], found.K[i]))
        numbers = (target, f"{arm.flexure.length:.3f}", K, signed_percent(miss), percent(found.error[i]))
        lines.append((f"{process.name} {arm.name}", *numbers, *line, f"{cost:.2g}", f"{loop:.2g}"))
    return lines, good


def main(arguments: Sequence[str]) -> int:
    """Write and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--tets", action="store_true", help="extrapolate from curved tetrahedra too")
    parser.add_argument("--only", nargs="*", default=tuple(PROCESSES), help="names of processes")
    parser.add_argument("--out", type=Path, default=OUT, help=f"folder of the page (default {OUT})")
    asked = parser.parse_args(arguments)
    table: list[tuple[str, ...]] = []
    refusals, all_good = [], True
    for name in asked.only:
        print(f"{name} ...", file=sys.stderr, flush=True)
        try:
            lines, good = rows(PROCESSES[name], asked.tets)
        except (InputError, MeshError) as refusal:
            refusals.append(f"{name}: {refusal}")
            all_good &= isinstance(refusal, InputError)
            continue
        all_good &= good
        table += lines
    goals = (
        f"goals: {percent(TARGET)} against target, {percent(SAME_MESH)} between CalculiX and FE, {percent(CHECK)} "
        f"between tetrahedra and FE, a fit at most {LOOP:g} times one mesh, assembly and solve"
    )
    notes = (goals, *refusals, *(() if is_installed() else ("CalculiX is not installed, so not measured",)))
    sheet = Sheet(name="processes", title="Default design", heads=HEADS, rows=tuple(table), notes=notes)
    words = INTRODUCTION.format(flags=" --tets" if asked.tets else "")
    publish(asked.out, {"process-springs.md": page("Springs of each process", words, sheet.markdown())}, as_json=False)
    return 0 if all_good else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
