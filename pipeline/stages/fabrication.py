"""What a maker needs beside the part: drawing, coupon, cover, sheet; verdicts on cover and sideways stiffness."""

from dataclasses import dataclass
from pathlib import Path

from cad.checks.assembly_checks import cover_verdicts
from cad.design.parameters import Design
from cad.files.drawing import Title
from cad.files.maker_files import write_fabrication
from cad.quantity import Estimate
from cad.verdict import Verdict
from mesh.housing.sweep import flexure_mesh
from pipeline.fit.mesh_pairs import COARSE
from pipeline.fit.mounts import attached_to
from pipeline.options import RunOptions
from pipeline.stages.fitted_spring import FittedSpring
from pipeline.stages.solids import sensor_of
from pipeline.stages.springs import FittedSprings
from pipeline.storage.cache import cached
from pipeline.verdicts.rules import margin_verdict
from solve.housing.stiffness import sideways_stiffness

SIDEWAYS_LEAST = {"low": 3.0, "high": 1.2}  # of the travel stiffness


@dataclass(frozen=True, kw_only=True)
class SidewaysStiffness:
    """The stiffness of each tip across the plate on a fine and on a coarse mesh [N/mm]."""

    fine: tuple[float, ...]
    coarse: tuple[float, ...]


def make_fabrication(design: Design, springs: FittedSprings, options: RunOptions, folder: Path) -> tuple[Verdict, ...]:
    """Write the files for fabrication, where asked for, and return the verdicts on cover and sideways stiffness."""
    if not options.fabrication:
        return ()
    return (*write_maker_files(design, springs, folder), *sideways_verdicts(springs))


def write_maker_files(design: Design, springs: FittedSprings, folder: Path) -> tuple[Verdict, ...]:
    """Write the files for fabrication and return the verdicts on the cover; nothing where no housing can be made.

    Raises OSError when a file cannot be written, ExportError when one read back has another volume.
    """
    if springs.housing is None:
        return ()
    sensor, process = sensor_of(design, springs.housing), springs.process
    _, cover = write_fabrication(sensor, Title(name=design.name, process=process), folder)
    return cover_verdicts(sensor, cover, process)


def sideways_verdicts(springs: FittedSprings) -> tuple[Verdict, ...]:
    """Return the verdicts on the stiffness across the plate over that along the press [1]; raises SolveError."""
    housing, process = springs.housing, springs.process
    if housing is None:
        return ()

    def solve(scale: float) -> tuple[float, ...]:
        mesh = flexure_mesh(housing, scale)
        return sideways_stiffness(mesh, process.E_MPa, process.poisson, attached_to(housing))

    stiffness = cached(
        "sideways",
        {"housing": housing, "E": process.E_MPa, "nu": process.poisson},
        lambda: SidewaysStiffness(fine=solve(1.0), coarse=solve(COARSE)),
        SidewaysStiffness,
    )
    rows = zip(springs.springs, stiffness.fine, stiffness.coarse, strict=True)
    return tuple(sideways_verdict(spring, fine, abs(fine - coarse)) for spring, fine, coarse in rows)


def sideways_verdict(spring: FittedSpring, K: float, error: float) -> Verdict:
    """Return the verdict on one sideways stiffness [N/mm], its error [N/mm] the step from a coarser mesh."""
    ratio = Estimate(K / spring.stiffness, error / spring.stiffness)
    words = "FE stiffness across the plate over that along the press; must be at least the limit"
    return margin_verdict(f"sideways.{spring.name}", ratio, SIDEWAYS_LEAST[spring.name], words)
