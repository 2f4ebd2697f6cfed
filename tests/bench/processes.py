"""Every process that can make the default sensor: fitted leaves, FE against its targets, CalculiX on the same mesh.

Run as a script from the root of the repository: `python tests/bench/processes.py [--tets 1.2 0.9] [--only NAME ...]`,
one thread: OMP_NUM_THREADS=1. `--tets` adds the extrapolation from curved tetrahedra of these sizes on the STEP file
read back (minutes and gigabytes). It prints a Markdown table and exits 1 when a goal is missed.
"""

import argparse
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from reference.flexure_reference import ReferenceStiffness, reference_stiffness  # noqa: E402
from reference.tetrahedra import fine_boxes, tetrahedra  # noqa: E402

from cad.design.parameters import Design, Print  # noqa: E402
from cad.design.processes import PROCESSES, Process  # noqa: E402
from cad.files.step import read_step, write_step  # noqa: E402
from cad.parts.housing import Housing, housing_part, named_housing  # noqa: E402
from cad.parts.sensor import Body  # noqa: E402
from mesh.housing.sweep import flexure_mesh  # noqa: E402
from mesh.session import MeshError  # noqa: E402
from pipeline.bench.calculix import absent, hexahedra  # noqa: E402
from pipeline.bench.flexure import beam_guess, calculix_stiffness  # noqa: E402
from pipeline.bench.hard.reference_check import DeclinedError  # noqa: E402
from pipeline.bench.table import percent  # noqa: E402
from pipeline.fit.leaf_lengths import fit_flexures  # noqa: E402

TARGET, SAME_MESH, CHECK = 1e-3, 1e-4, 3e-3  # goals, relative: FE to target, CalculiX to FE, extrapolated tets to FE
CHOICE, KIND = "hex 20, reduced", "C3D20R"
HEADS = ("process", "target N/m", "L mm", "FE N/m", "against target", "error bar", "CalculiX - FE", "tets - FE, spread")


def checked(housing: Housing, process: Process, sizes: Sequence[float]) -> ReferenceStiffness:
    """Return the stiffness that curved tetrahedra find on the housing's STEP file, extrapolated."""
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "housing.step"
        shape = housing_part(housing).shape
        write_step([Body(name="housing", shape=shape, colour=(0.5, 0.5, 0.5))], path, "housing")
        part = named_housing(read_step(path), housing)
    meshes = [tetrahedra(part, fine_boxes(housing, size), size) for size in sizes]
    return reference_stiffness(meshes, sizes, process.E_MPa, process.poisson)


def rows(process: Process, sizes: Sequence[float]) -> tuple[list[tuple[str, ...]], bool]:
    """Return the lines of both springs of a process, and whether they meet every goal that was looked at."""
    guess, targets = beam_guess(Design(print=Print(process=process.name)))
    material = (process.E_MPa, process.poisson)
    fitted = fit_flexures(guess, *targets, *material)
    found, housing = fitted.stiffness, fitted.housing
    peer = tets = None
    if "CalculiX (ccx)" not in absent():
        mesh = flexure_mesh(housing)
        peer, _ = calculix_stiffness(hexahedra(mesh, KIND), mesh, CHOICE, material)
    if sizes:
        tets = checked(housing, process, sizes)
    lines, good = [], True
    for i, (side, flexure) in enumerate((("low", housing.low), ("high", housing.high))):
        miss, line = found.K[i] / targets[i] - 1.0, ["-", "-"]
        good &= abs(miss) <= TARGET
        if peer is not None:
            apart = peer[i] / found.K[i] - 1.0
            good &= abs(apart) <= SAME_MESH
            line[0] = percent(apart)
        if tets is not None:
            apart = tets.K[i] / found.K[i] - 1.0
            good &= abs(apart) <= CHECK
            line[1] = f"{percent(apart)}, {tets.spread_percent[i]:.2g} %"
        target, K = (f"{1e3 * value:.6g}" for value in (targets[i], found.K[i]))
        bar = f"{found.error_percent[i]:.2g} %"
        lines.append((f"{process.name} {side}", target, f"{flexure.length:.3f}", K, percent(miss), bar, *line))
    return lines, good


def main(arguments: Sequence[str]) -> int:
    """Print the table line by line."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--tets", type=float, nargs="*", default=(), help="relative sizes of two or three meshes")
    parser.add_argument("--only", nargs="*", default=tuple(PROCESSES), help="names of processes")
    asked = parser.parse_args(arguments)
    print(f"| {' | '.join(HEADS)} |\n| --- |{' ---: |' * (len(HEADS) - 1)}")
    all_good = True
    for name in asked.only:
        try:
            lines, good = rows(PROCESSES[name], asked.tets)
        except (DeclinedError, MeshError) as refusal:
            print(f"{name}: {refusal}", file=sys.stderr)
            all_good &= isinstance(refusal, DeclinedError)
            continue
        all_good &= good
        print("\n".join(f"| {' | '.join(line)} |" for line in lines), flush=True)
    return 0 if all_good else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
