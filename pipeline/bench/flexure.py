"""Work and precision of the flexures' stiffness on one housing: elements, integration, beam formulas, CalculiX.

Run as a program it prints its measurements as JSON: a fresh interpreter on one thread, imports not counted.
"""

import dataclasses
import json
import sys
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from cad.design.parameters import Design, Print
from cad.design.printability import check_printable
from cad.design.processes import PROCESSES
from cad.parts.housing import Housing
from cad.parts.housing_half import housing_half
from cad.parts.layout import housing_for
from cad.theory.flexure import Flexure
from cad.theory.leaf_spring import pair_stiffness
from mesh.housing.sweep import flexure_mesh
from mesh.volume import SizeField, volume_mesh
from pipeline.bench.calculix import Elements, LinearStep, SkfemMesh, absent, calculix, hexahedra, node_set, tetrahedra
from pipeline.bench.contact import timed
from pipeline.bench.hard.reference_check import DeclinedError
from pipeline.bench.table import Measured
from pipeline.fit.leaf_lengths import RUNGS, fit_flexures
from pipeline.stages.contact import contact_compliance
from pipeline.stages.sizing import size
from solve.housing.element_study import TIPS, Compared, boundary_places, compared_stiffness, face_load, straightened
from solve.housing.stiffness import TipCompliance, housing_stiffness, tip_compliance
from solve.linear import SolveError

# The default sensor in PETG: thickness, lengths and levels [mm] as its layout gives them, kept here so that the
# reference stays valid.
HOUSING = Housing(
    low=Flexure(thickness=0.8, length=24.2, depth=10.0, separation=14.0, fillet=0.5),
    high=Flexure(thickness=1.2, length=12.1, depth=10.0, separation=14.0, fillet=0.5),
    tip_side=1.0, tip_height=1.0, spacing=8.0, shuttle_width=6.0, neck_level=5.5, lower_leaf_level=7.6,
    low_top_level=23.7, high_top_level=24.09, cavity_level=24.39, top_level=30.39, protrusion=1.7,
)  # fmt: skip
E_MPA, POISSON = 2000.0, 0.38
# Reduced and full integration of 20-node hexahedra at 295k dofs, the latter extrapolated from 111k, agree to 1.1e-4.
REFERENCE = {"low": 1.55808, "high": 36.4046, "uncertainty": 1e-4}
SCALES = {
    "hex 20, reduced": (4.0, 2.0, 1.0, 0.5),
    "hex 20, full": (2.0, 1.0),
    "hex 27, full": (2.0, 1.0),
    "hex 8": (2.0, 1.0),
}
TET_SIZES = (0.8, 0.4)  # [mm] at the outline of the leaves
SHEAR = 5.0 / 6.0  # shear coefficient of a rectangle, S. Timoshenko 1921


def errors(K: tuple[float, float]) -> tuple[float, float]:
    """Return the relative errors of the low and the high stiffness against the reference."""
    return K[0] / REFERENCE["low"] - 1.0, K[1] / REFERENCE["high"] - 1.0


def _row(method: str, mesh: str, K: tuple[float, float], cost: tuple[int | None, float], bar: float | None) -> Measured:
    first, second = errors(K)
    return Measured(method=method, mesh=mesh, cpu=cost[1], dofs=cost[0], error=first, second=second, estimated=bar)


def beam_rows() -> Iterator[Measured]:
    """Yield the closed formulas: Euler, Timoshenko, and Timoshenko with the plane-strain modulus of a wide leaf."""
    for name, modulus, shear in (
        ("beam, Euler", E_MPA, False),
        ("beam, Timoshenko", E_MPA, True),
        ("beam, wide Timoshenko", E_MPA / (1.0 - POISSON**2), True),
    ):
        K, cpu = timed(partial(_beams, modulus, shear))
        yield _row(name, "-", K, (None, cpu), None)


def _beams(modulus: float, shear: bool) -> tuple[float, float]:
    return _beam(HOUSING.low, modulus, shear), _beam(HOUSING.high, modulus, shear)


def _beam(flexure: Flexure, modulus: float, shear: bool) -> float:
    give = 1.0 / pair_stiffness(modulus, flexure.depth, flexure.thickness, flexure.length)
    if shear:
        G = 0.5 * E_MPA / (1.0 + POISSON)
        give += flexure.length / (2.0 * SHEAR * G * flexure.depth * flexure.thickness)
    return 1.0 / give


def product_rows() -> Iterator[Measured]:
    """Yield the product's own solver from coarse to fine, with its error bar where the ladder has that mesh."""
    known: dict[float, TipCompliance] = {}
    for scale in SCALES["hex 20, reduced"]:
        mesh, meshing = timed(partial(flexure_mesh, HOUSING, scale))
        found, cpu = timed(partial(tip_compliance, mesh, E_MPA, POISSON))
        known[scale], bar = found, None
        for rung in RUNGS:
            if rung.fine == scale:
                apart = housing_stiffness(found, known[rung.coarse]).error_percent
                bar = 0.01 * rung.bars(HOUSING, apart)[0]
        yield _row("ours: hex 20, reduced, curved", f"scale {scale:g}", found.K, (found.dofs, meshing + cpu), bar)


def other_rows(with_peers: bool) -> Iterator[Measured]:
    """Yield the other elements on the same meshes, straight edges, tetrahedra, and CalculiX."""
    for choice, scales in SCALES.items():
        for scale in scales:
            mesh, meshing = timed(partial(flexure_mesh, HOUSING, scale))
            if choice != "hex 20, reduced":
                method = choice if choice == "hex 8" else f"{choice}, curved"
                yield _solved(method, mesh, (choice, f"scale {scale:g}"), meshing)
            elif scale in (2.0, 1.0):
                straight = straightened(mesh)
                yield _solved(f"{choice}, straight", straight, (choice, f"scale {scale:g}"), meshing)
                if with_peers:
                    for kind in ("C3D20R", "C3D20"):
                        yield from _calculix_row(hexahedra(mesh, kind), mesh, (choice, f"scale {scale:g}"), meshing)
    half = housing_half(HOUSING)
    for finest in TET_SIZES:
        field = SizeField(largest_mm=4.0, smallest_mm=finest, growth=0.4, faces=("low_leaves", "high_leaves"))
        mesh, meshing = timed(partial(volume_mesh, half, field, tolerance=0.05))
        for choice in ("tet P1", "tet P2"):
            yield _solved(f"{choice}, straight", mesh, (choice, f"leaf {finest:g} mm"), meshing)
        if with_peers and finest == TET_SIZES[0]:
            yield from _calculix_row(tetrahedra(mesh), mesh, ("tet P2", f"leaf {finest:g} mm"), meshing)


def _solved(method: str, mesh: SkfemMesh, how: tuple[str, str], meshing: float) -> Measured:
    found: Compared
    found, cpu = timed(lambda: compared_stiffness(mesh, how[0], E_MPA, POISSON))
    return _row(method, how[1], found.K, (found.dofs, meshing + cpu), None)


def _calculix_row(elements: Elements, mesh: SkfemMesh, how: tuple[str, str], meshing: float) -> Iterator[Measured]:
    choice, name = how
    try:
        K, cpu = calculix_stiffness(elements, mesh, choice, (E_MPA, POISSON))
    except SolveError as refused:
        print(f"{refused}", file=sys.stderr)
        return
    yield _row(f"CalculiX {elements.kind}", name, K, (3 * elements.nodes.shape[1], meshing + cpu), None)


def calculix_stiffness(
    elements: Elements, mesh: SkfemMesh, choice: str, material: tuple[float, float]
) -> tuple[tuple[float, float], float]:
    """Return both stiffnesses of the half housing [N/mm from E in MPa and nu, mm] by CalculiX, and its CPU seconds.

    `choice` names the like element of `solve.comparison`, whose nodes and loads are taken. Raises SolveError.
    """
    names = ("mounting_holes", "symmetry")
    sets = {one: node_set(elements, boundary_places(mesh, choice, one)) for one in names}
    loads = []
    for tip in TIPS:
        load = face_load(mesh, choice, tip)
        loads.append(dict(zip(node_set(elements, load.places).tolist(), load.forces.tolist(), strict=True)))
    sets["tips"] = np.unique(np.array([node for load in loads for node in load]))
    held = {"mounting_holes": (1, 2, 3), "symmetry": (2,)}
    # Half the force on half the part.
    steps = [LinearStep(held=held, pressed={}, loads={node: 0.5 * f for node, f in load.items()}) for load in loads]
    found = calculix(elements, sets, material, steps, "tips")
    low, high = (
        1.0 / sum(u[node] * f for node, f in load.items()) for u, load in zip(found.displacements, loads, strict=True)
    )
    return (low, high), found.cpu


def beam_guess(design: Design) -> tuple[Housing, tuple[float, float]]:
    """Return the housing with leaves as long as the beam law has them [mm], and the stiffnesses asked for [N/mm].

    Raises DeclinedError with the reason where the process cannot make a spring, InputError where no housing fits.
    """
    process = PROCESSES[design.print.process]
    sizing = size(design, contact_compliance(design.fruit, design.tips), "contact")
    printable = check_printable(design, sizing.springs, sizing.K_m_max_contact, process)
    for one in printable:
        if one.passed is False:
            raise DeclinedError(one.reason)
    lengths = (printable[0].length_mm, printable[1].length_mm)
    return housing_for(design, process, lengths, sizing.deflections(design.full_travels_mm)), (
        sizing.springs.K_l,
        sizing.springs.K_h,
    )


def closed_loops() -> tuple[list[Measured], dict[str, float]]:
    """Return what fitting both leaf lengths to 0.1 % costs in each process that can be made, and the dearest loop.

    The measure is one mesh, assembly and solve of the final housing [CPU s]; errors are against the targets.
    """
    rows, costs = [], []
    for process in PROCESSES.values():
        try:
            guess, targets = beam_guess(Design(print=Print(process=process.name)))
        except DeclinedError:
            continue
        material = (process.E_MPa, process.poisson)
        fitted, loop = timed(partial(fit_flexures, guess, *targets, *material))
        mesh, meshing = timed(partial(flexure_mesh, fitted.housing))
        _, solving = timed(partial(tip_compliance, mesh, *material))
        once = meshing + solving
        low, high = (K / target - 1.0 for K, target in zip(fitted.stiffness.K, targets, strict=True))
        rows.append(
            Measured(
                method="closed loop to 0.1 %", mesh=process.name, cpu=loop, error=low, second=high,
                estimated=0.01 * fitted.stiffness.error_percent[0],
                remark=f"against targets; {loop / once:.1f} x one mesh + solve",
            )
        )  # fmt: skip
        costs.append({"loop": loop, "once": once, "fine": fitted.solves[0], "coarse": fitted.solves[1]})
    return rows, max(costs, key=lambda cost: cost["loop"] / cost["once"])


def measure(quick: bool) -> dict[str, Any]:
    """Return every measurement; `quick` keeps the beam formulas and the product's two coarsest meshes."""
    rows = [*beam_rows()]
    if quick:
        rows += [row for row, _ in zip(product_rows(), range(2), strict=False)]
        return {"rows": [dataclasses.asdict(row) for row in rows], "loop": {}}
    loops, dearest = closed_loops()
    rows += [*product_rows(), *other_rows("CalculiX (ccx)" not in absent()), *loops]
    return {"rows": [dataclasses.asdict(row) for row in rows], "loop": dearest}


def main(arguments: Sequence[str]) -> None:
    """Print the measurements as JSON."""
    print(json.dumps(measure("--quick" in arguments), allow_nan=False))


if __name__ == "__main__":
    main(sys.argv[1:])
