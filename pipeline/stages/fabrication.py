"""`pipeline design`: the main job and what a maker needs beside it, files, sideways stiffness and tolerance bands."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

from cad.design.parameters import Design
from cad.design.processes import Process
from cad.files.drawing import Title
from cad.files.maker_files import write_fabrication
from cad.parts.housing import Housing
from cad.verdict import Verdict
from mesh.housing.sweep import flexure_mesh
from pipeline.fit.foils import bonded_foils
from pipeline.fit.leaf_lengths import COARSE
from pipeline.options import RunOptions
from pipeline.run import RunResult, run
from pipeline.stages.solids import sensor_of
from pipeline.stages.springs import PrintedSpring, PrintedSprings
from pipeline.stages.verdict_rules import on_right_side
from pipeline.stages.verdicts import Case
from pipeline.storage.cache import remembered
from pipeline.storage.stopwatch import Stopwatch
from pipeline.uncertainty.print_scatter import Surrogate, bands, fit_surrogate
from solve.housing.stiffness import sideways_stiffness, tip_compliance

SIDEWAYS_LEAST = {"low": 3.0, "high": 1.2}  # of the travel stiffness
_SIDEWAYS_ERROR = 1.0  # of the step from the coarse mesh


def fabricate(design: Design, options: RunOptions) -> RunResult:
    """Run every stage, and add the files for fabrication with the verdicts and bands that go with them."""
    return run(design, options, _for_the_maker)


def _for_the_maker(
    case: Case, printed: PrintedSprings, folder: Path, clock: Stopwatch
) -> tuple[tuple[Verdict, ...], dict[str, Any]]:
    housing, process, design = printed.housing, printed.process, case.design
    if housing is None:
        return (), {"tolerance": None}
    with clock.stage("fabrication"):
        _, cover = write_fabrication(sensor_of(design, housing), Title(name=design.name, process=process), folder)
    with clock.stage("sideways"):
        verdicts = (*cover, *sideways_verdicts(printed, housing))
    with clock.stage("tolerance"):
        surrogate = _surrogate(housing, process)
        found = bands(housing, process, case.judged(printed.stiffnesses), design.targets, surrogate)
    return verdicts, {"tolerance": asdict(found)}


def _surrogate(housing: Housing, process: Process) -> Surrogate:
    def coarse(changed: Housing) -> tuple[float, float]:
        foils = bonded_foils(changed)
        return tip_compliance(flexure_mesh(changed, COARSE), process.E_MPa, process.poisson, foils).K

    inputs = {"housing": asdict(housing), "process": asdict(process)}
    found = remembered("surrogate", inputs, lambda: asdict(fit_surrogate(housing, process.accuracy_mm, coarse)))
    return Surrogate(slopes=tuple(found["slopes"]), curves=tuple(found["curves"]), corner_error=found["corner_error"])


def sideways_verdicts(printed: PrintedSprings, housing: Housing) -> tuple[Verdict, ...]:
    """Return the verdicts on the stiffness across the plate over that along the press."""
    fine, coarse = _sideways(housing, printed.process)
    return tuple(
        sideways_verdict(spring, fine[index], abs(fine[index] - coarse[index]))
        for index, spring in enumerate((printed.low, printed.high))
    )


def _sideways(housing: Housing, process: Process) -> tuple[list[float], list[float]]:
    def solved() -> dict[str, list[float]]:
        scales, foils = {"fine": 1.0, "coarse": COARSE}, bonded_foils(housing)
        return {
            name: list(sideways_stiffness(flexure_mesh(housing, scale), process.E_MPa, process.poisson, foils))
            for name, scale in scales.items()
        }

    found = remembered("sideways", {"housing": asdict(housing), "E": process.E_MPa, "nu": process.poisson}, solved)
    return found["fine"], found["coarse"]


def sideways_verdict(spring: PrintedSpring, K: float, step: float) -> Verdict:
    """Return the verdict on one sideways stiffness [N/mm], known to the step from a coarser mesh."""
    stiffness, least = spring.stiffness or spring.target, SIDEWAYS_LEAST[spring.name]
    ratio, error = K / stiffness, _SIDEWAYS_ERROR * step / stiffness
    return Verdict(
        name=f"sideways.{spring.name}",
        value=ratio,
        unit="1",
        limit=least,
        tolerance=0.0,
        passed=on_right_side(ratio - least, error),
        reference="FE stiffness across the plate over that along the press; must be at least the limit",
        error=error,
    )
