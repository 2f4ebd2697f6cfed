"""A design whose springs are fitted by finite elements, without its files or with all of them."""

from pathlib import Path

from cad.design.parameters import Design
from pipeline import run
from pipeline.evaluate import check_targets
from pipeline.options import RunOptions
from pipeline.report.mapping import (
    report_mapping,
    stored_contact,
    stored_reading,
    stored_response,
    stored_sizing,
    stored_spring,
    stored_targets,
)
from pipeline.report.stored import as_data
from pipeline.storage.plain import Plain


def fitted_report(design: Design, tolerance: float) -> Plain:
    """Return the part of report.json that needs no solid, its springs fitted to a relative tolerance [1].

    The numbers are those of a run, to the bit. Raises InputError, MeshError or SolveError.
    """
    found = check_targets(design, RunOptions(tolerance=tolerance))
    springs = found.springs
    report: Plain = as_data(
        {
            "springs": stored_sizing(found.sizing),
            "flexures": {spring.name: stored_spring(spring, springs) for spring in springs.springs},
            "deflections_mm": springs.deflections,
            "contact": stored_contact(found.contact),
            "response": stored_response(design.tips, found.contact, springs, found.solved_press.table),
            "reading": None if found.readings is None else stored_reading(found.readings),
            "level": stored_targets(found.reached),
            "verdicts": found.verdicts,
        }
    )
    return report


def whole_report(design: Design, tolerance: float, out: Path | None) -> Plain:
    """Return report.json of a whole run to a relative tolerance [1], its files in the folder, and `passed` beside it.

    Raises InputError, MeshError or SolveError.
    """
    result = run(design, RunOptions(out=out, tolerance=tolerance), beside=False)  # a study has a process for each core
    return {**report_mapping(result), "passed": result.passed}
