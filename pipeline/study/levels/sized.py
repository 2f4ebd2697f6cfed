"""A design whose springs are exactly as they were sized or given, or as a print has them: no solid and no fit."""

import numpy as np

from cad.design.parameters import Design
from pipeline.evaluate import PARTS, Part, check_targets
from pipeline.options import RunOptions
from pipeline.report.mapping import stored_contact, stored_reading, stored_row, stored_sizing, stored_targets
from pipeline.report.stored import StoredResponse, as_data
from pipeline.response.scene_press import ScenePress, scene_of
from pipeline.springs.fitted_springs import ideal_springs
from pipeline.springs.sizing import spring_sizing
from pipeline.storage.plain import Plain
from pipeline.study.levels.printed import AS_DRAWN, PrintMiss, printed_sizing
from pipeline.study.report_keys import Stage
from solve.fruit.compliance import FruitCompliance

CLOSED_FORMS: frozenset[Stage] = frozenset(("sizing", "level", "printable"))  # whatever the press


def sized_report(
    design: Design, contact: FruitCompliance, stages: frozenset[Stage], miss: PrintMiss = AS_DRAWN
) -> Plain:
    """Return the part of report.json that some stages give, for springs as sized, or as a print misses them.

    Raises InputError for a design that cannot be sized, pressed or read, SolveError where a press is not to be
    believed.
    """
    drawn = spring_sizing(design, contact, RunOptions())
    sizing = printed_sizing(design, drawn, miss)
    springs = ideal_springs(design, drawn, sizing.springs)
    parts = tuple(part for part in PARTS if _is_needed(part, design, stages))
    checked = check_targets(design, contact=contact, sizing=sizing, springs=springs, parts=parts)
    report: Plain = {"springs": stored_sizing(sizing), "contact": stored_contact(contact)}
    if checked.press is not None:
        report["response"] = _rows(design, checked.press)
    if checked.readings is not None:
        report["reading"] = stored_reading(checked.readings)
    report["level"] = stored_targets(checked.reached)
    report["verdicts"] = checked.verdicts
    plain: Plain = as_data(report)
    return plain


def _is_needed(part: Part, design: Design, stages: frozenset[Stage]) -> bool:
    """Say whether a part must be solved: a level sensor on flat fruit has P_max and NL by the law alone."""
    if part == "reading":
        return "reading" in stages
    if "response" in stages or ("reading" in stages and design.reading is None):
        return True
    return "targets" in stages and not scene_of(design).linear


def _rows(design: Design, press: ScenePress) -> list[StoredResponse]:
    exact = np.zeros(len(design.tips.springs))  # springs exactly as sized have no error
    return [stored_row(press.table, i, design.tips, exact) for i in range(len(press.table.E))]
