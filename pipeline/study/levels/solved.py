"""A design whose springs are fitted by finite elements, without its files or with all of them."""

from dataclasses import asdict
from pathlib import Path

from cad.design.parameters import Design
from cad.design.tip_mount import plate_depth
from pipeline import run
from pipeline.options import RunOptions
from pipeline.reading.placed import refuse_steep_poses
from pipeline.reading.sensor_readings import assess_readings
from pipeline.report.contact_keys import assessed_mapping, contact_mapping, level_mapping, sizing_mapping
from pipeline.report.mapping import report_mapping, response_mapping, spring_mapping
from pipeline.stages.contact import fruit_compliance
from pipeline.stages.response import refuse_unsolvable
from pipeline.stages.sizing import spring_sizing
from pipeline.stages.springs import fit_springs, press_of_springs
from pipeline.storage.plain import Plain
from pipeline.verdicts.reading_rules import reading_verdicts
from pipeline.verdicts.sensor import judge


def fitted_report(design: Design, tolerance: float) -> Plain:
    """Return the part of report.json that needs no solid, its springs fitted to a relative tolerance [1].

    The numbers are those of a run, to the bit. Raises InputError, MeshError or SolveError.
    """
    options = RunOptions(tolerance=tolerance)
    refuse_unsolvable(design)
    refuse_steep_poses(design)
    plate_depth(design, design.process)  # refuses tips that leave no plate
    contact = fruit_compliance(design, options)
    sizing = spring_sizing(design, contact, options)
    springs = fit_springs(design, sizing, options)
    press = press_of_springs(design, contact, springs)
    readings = assess_readings(design, contact, springs)
    judged = judge(design, contact, sizing, springs, (), press)
    verdicts = *reading_verdicts(design, readings), *judged.verdicts
    return {
        "springs": sizing_mapping(sizing),
        "flexures": {spring.name: spring_mapping(spring, springs) for spring in springs.springs},
        "deflections_mm": list(springs.deflections),
        "contact": contact_mapping(contact),
        "response": response_mapping(design.tips, contact, springs, press.table),
        "reading": None if readings is None else assessed_mapping(readings),
        "level": level_mapping(judged.reached),
        "verdicts": [asdict(verdict) for verdict in verdicts if verdict.name != "geometry.made"],
    }


def whole_report(design: Design, tolerance: float, out: Path | None) -> Plain:
    """Return report.json of a whole run to a relative tolerance [1], its files in the folder, and `passed` beside it.

    Raises InputError, MeshError or SolveError.
    """
    result = run(design, RunOptions(out=out, tolerance=tolerance))
    return {**report_mapping(result), "passed": result.passed}
