"""A design whose springs are fitted by finite elements, without its files or with all of them."""

from dataclasses import asdict
from pathlib import Path

from cad.design.parameters import Design
from pipeline import run
from pipeline.evaluate import check_targets
from pipeline.options import RunOptions
from pipeline.report.contact_keys import assessed_mapping, contact_mapping, level_mapping, sizing_mapping
from pipeline.report.mapping import report_mapping, response_mapping, spring_mapping
from pipeline.storage.plain import Plain


def fitted_report(design: Design, tolerance: float) -> Plain:
    """Return the part of report.json that needs no solid, its springs fitted to a relative tolerance [1].

    The numbers are those of a run, to the bit. Raises InputError, MeshError or SolveError.
    """
    found = check_targets(design, RunOptions(tolerance=tolerance))
    springs = found.springs
    return {
        "springs": sizing_mapping(found.sizing),
        "flexures": {spring.name: spring_mapping(spring, springs) for spring in springs.springs},
        "deflections_mm": list(springs.deflections),
        "contact": contact_mapping(found.contact),
        "response": response_mapping(design.tips, found.contact, springs, found.solved_press.table),
        "reading": None if found.readings is None else assessed_mapping(found.readings),
        "level": level_mapping(found.reached),
        "verdicts": [asdict(verdict) for verdict in found.verdicts],
    }


def whole_report(design: Design, tolerance: float, out: Path | None) -> Plain:
    """Return report.json of a whole run to a relative tolerance [1], its files in the folder, and `passed` beside it.

    Raises InputError, MeshError or SolveError.
    """
    result = run(design, RunOptions(out=out, tolerance=tolerance), beside=False)  # a study has a process for each core
    return {**report_mapping(result), "passed": result.passed}
