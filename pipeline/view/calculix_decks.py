"""The scenes of an output folder as decks that CalculiX runs as they are, with the answers to compare its own with."""

from pathlib import Path

import numpy as np

from cad.design.parameters import Design
from cad.parts.fruit import solved_block
from cad.quantity import validation_error
from mesh.fruit import fruit_mesh
from mesh.housing.sweep import flexure_mesh
from pipeline.decks.scenes import HEXAHEDRA, contact_deck, flexure_deck
from pipeline.report.stored import StoredReport, read_report
from pipeline.storage.placed_files import place_files
from solve.arrays import Floats
from solve.fruit.direct import MIDDLE, mesh_compliance
from solve.housing.element_study import element_stiffness
from solve.housing.stiffness import SPRINGS

FLAG = "--inp"
INDENTATION = 0.1  # of the side of a tip
_COARSEST = 1.0  # scale of the mesh of the fruit


def write_decks(folder: Path, target: Path, *, force: bool = False) -> list[Path]:
    """Write flexure.inp and, under a pair of flat square tips, contact.inp; return the paths.

    The same folder gives the same bytes. Raises InputError where neither can be written, the target cannot be written
    or holds foreign files that `force` does not keep aside, SolveError.
    """
    report = read_report(folder)
    decks = {"flexure.inp": _flexure(report), "contact.inp": _contact(report.design)}
    files = {name: text.encode("ascii") for name, text in decks.items() if text is not None}
    if not files:
        bound = "a design with a housing, or with a pair of flat square tips on a block"
        raise validation_error("DIR", str(folder), "", bound, "run such a design")
    return place_files(target, files, FLAG, force=force)


def _flexure(report: StoredReport) -> str | None:
    """Return the deck of the half housing, its holes held; None where there is no housing."""
    if report.housing is None:
        return None
    process, mesh = report.design.process, flexure_mesh(report.housing)
    scene = flexure_deck(mesh, *HEXAHEDRA, process.E_MPa, process.poisson)
    found = element_stiffness(mesh, HEXAHEDRA[0], process.E_MPa, process.poisson)
    stiffnesses = ", ".join(f"{K:.9g} N/mm of the {name} spring" for name, K in zip(SPRINGS, found.K, strict=True))
    heading = [
        f"{_ascii(report.design.name)}: half y >= 0 of the housing, N, mm, MPa; step 1: 0.5 N on half of the low tip,",
        "that is 1 N on the whole, step 2: the same on the high tip. The walls of the holes are held: a mount of its",
        "own, to compare solvers with; covers and washers hold the frame in another way, and report.json is of those.",
        "Displacements of the nodes of both tips' faces are printed. Stiffness = 1 N over the mean of u_z over the",
        "face of the tip (nodes weighted as the forces of its step). twintip finds on this very mesh, hexahedra of 20",
        f"nodes and 8 Gauss points: {stiffnesses}.",
    ]
    return scene.deck.text(heading)


def _contact(design: Design) -> str | None:
    """Return the deck of the fruit under two rigid tips; None where the tips are no flat squares in a pair."""
    tips, block = design.tips.flat, design.fruit.equivalent_block
    if tips.layout != "pair" or tips.tip_shape.is_round or tips != design.tips or block != design.fruit:
        return None
    part = solved_block(block, tips)
    mesh, E, shift = fruit_mesh(part, block, tips, _COARSEST), design.fruit.E_max_MPa, -INDENTATION * tips.side_mm
    S = mesh_compliance(mesh, block.poisson).S
    heading = [
        f"{_ascii(design.name)}: fruit under rigid flat tips without friction, N, mm, MPa; E {E:g} MPa, base clamped;",
        f"u_z = {shift:g} mm on the face of a pressed tip.",
        *_expected(MIDDLE in (mesh.boundaries or {}), S, E, shift),
        "Coarsest of three meshes: its error is that of the mesh, report.json has the extrapolated answer.",
    ]
    return contact_deck(mesh, E, block.poisson, shift).text(heading)


def _expected(quarter: bool, S: Floats, E: float, shift: float) -> list[str]:
    """Return what twintip finds on the same mesh, in the steps of the deck."""
    if quarter:
        alike, against = (0.5 * E * shift / (S[0, 0] + sign * S[0, 1]) for sign in (1.0, -1.0))
        return [
            "Quarter x, y >= 0. Step 1: both tips pressed alike, step 2: one down, one up. twintip finds on this mesh",
            f"for half of the high tip: total force {alike:.9g} N in step 1, {against:.9g} N in step 2.",
        ]
    own = 0.5 * E * shift * np.linalg.inv(S)
    return [
        "Half y >= 0. Step 1: the low tip pressed, the high one held, step 2: the other way round. twintip finds on",
        f"this mesh for half of the pressed tip: total force {own[0, 0]:.9g} N in step 1, {own[1, 1]:.9g} N in step 2.",
    ]


def _ascii(name: str) -> str:
    return name.encode("ascii", "replace").decode()
