"""A design whose springs are exactly as they were sized or given, or as a print has them: no solid and no fit."""

from collections.abc import Iterator
from dataclasses import asdict

import numpy as np

from cad.design.parameters import Design
from cad.design.tip_mount import plate_depth
from cad.verdict import Verdict
from pipeline.options import RunOptions
from pipeline.reading.assessment import reading_assessment
from pipeline.reading.bruising import skin_pressures
from pipeline.reading.placed import refuse_unsolvable_presses
from pipeline.reading.pressed_sensor import pressed_sensor
from pipeline.reading.readings import Readings
from pipeline.report.contact_keys import assessed_mapping, contact_mapping, level_mapping, response_row, sizing_mapping
from pipeline.response.scene_press import ScenePress, mean_pressure_estimate, press_scene, scene_of
from pipeline.springs.fitted_spring import springs_as_sized
from pipeline.springs.sizing import SpringSizing, spring_sizing
from pipeline.storage.plain import Plain
from pipeline.study.levels.printed import AS_DRAWN, PrintMiss, printed_sizing
from pipeline.study.report_keys import Stage
from pipeline.verdicts.characteristic import characteristic
from pipeline.verdicts.reading_rules import reading_verdicts
from pipeline.verdicts.rules import (
    bruise_verdict,
    displacement_verdict,
    monotonic_verdict,
    printable_verdict,
    target_verdicts,
)
from pipeline.verdicts.scene_targets import SceneTargets, scene_targets
from pipeline.verdicts.tip_shape import tip_shape_verdicts
from solve.contact.linear_response import spring_compliance
from solve.fruit.compliance import FruitCompliance

CLOSED_FORMS: frozenset[Stage] = frozenset(("sizing", "level", "printable"))  # whatever the press
_OF_WHAT = "of springs exactly as they were sized or given"


def sized_report(
    design: Design, contact: FruitCompliance, stages: frozenset[Stage], miss: PrintMiss = AS_DRAWN
) -> Plain:
    """Return the part of report.json that some stages give, for springs as sized, or as a print misses them.

    Raises InputError for a design that cannot be sized, pressed or read, SolveError where a press is not to be
    believed.
    """
    drawn, sizing = _sizings(design, contact, miss)
    _refuse_bad(design, stages)
    report: Plain = {"springs": sizing_mapping(sizing), "contact": contact_mapping(contact)}
    press = None
    if _presses(design, stages):
        press = press_scene(design, contact, _compliance(design, sizing))
        report["response"] = _rows(design, press)
    verdicts: list[Verdict] = []
    if "printable" in stages:
        verdicts += [printable_verdict(spring) for spring in springs_as_sized(design, drawn)]
    readings = _readings(design, contact, sizing) if "reading" in stages else None
    if readings is not None:
        report["reading"] = assessed_mapping(readings)
        verdicts += reading_verdicts(design, readings)
    if stages & {"level", "targets"}:
        reached = _reached(design, contact, sizing, press)
        report["level"] = level_mapping(reached)
        verdicts += _target_verdicts(design, reached)
    verdicts += _press_verdicts(design, press)
    return report | {"verdicts": [asdict(verdict) for verdict in verdicts]}


def _sizings(design: Design, contact: FruitCompliance, miss: PrintMiss) -> tuple[SpringSizing, SpringSizing]:
    """Return the springs as drawn, and those of a print that misses the drawing."""
    drawn = spring_sizing(design, contact, RunOptions())
    return drawn, printed_sizing(design, drawn, miss)


def _refuse_bad(design: Design, stages: frozenset[Stage]) -> None:
    """Raise InputError for tips that leave no plate, and for a scene that some stages cannot solve."""
    plate_depth(design, design.process)
    if stages - CLOSED_FORMS:
        refuse_unsolvable_presses(design)


def _presses(design: Design, stages: frozenset[Stage]) -> bool:
    """Say whether forces over the travel are needed: a level sensor on flat fruit has P_max and NL by the law alone."""
    if "response" in stages or ("reading" in stages and design.reading is None):
        return True
    return "targets" in stages and not scene_of(design).linear


def _compliance(design: Design, sizing: SpringSizing) -> np.ndarray:
    """Return the compliance of all tips by their springs, shape (tips, tips) [mm/N]."""
    return spring_compliance(*design.tips.each(*sizing.springs.stiffnesses))


def _reached(design: Design, contact: FruitCompliance, sizing: SpringSizing, press: ScenePress | None) -> SceneTargets:
    """Return P_max and NL of the scene, those of a level sensor where it was not pressed."""
    pair = contact.of_kinds(*design.tips.kinds)
    own = characteristic(pair, sizing, sizing.springs)
    if press is None:
        level = own.P_max(), own.NL(design.nominal_targets)
        return SceneTargets(P_max=level[0], NL=level[1], level=level)
    C = spring_compliance(*sizing.springs.stiffnesses)
    return scene_targets(own, design.nominal_targets, pair, C, press)


def _readings(design: Design, contact: FruitCompliance, sizing: SpringSizing) -> Readings | None:
    """Return how good readings are; None for a design that is judged by its ratio."""
    if design.reading is None:
        return None
    sensor = pressed_sensor(design, contact, _compliance(design, sizing))
    return Readings(assessed=reading_assessment(sensor, design.reading), pressures=skin_pressures(sensor))


def _target_verdicts(design: Design, reached: SceneTargets) -> tuple[Verdict, ...]:
    """Return the verdicts on P_max and NL, none for a design that is judged by its readings."""
    if design.reading is not None:
        return ()
    return target_verdicts(reached.P_max, reached.NL, design.nominal_targets, _OF_WHAT)


def _press_verdicts(design: Design, press: ScenePress | None) -> Iterator[Verdict]:
    """Yield the verdicts on the press that a run gives a design without a reading, and those on its tips."""
    if press is None:
        return
    if design.reading is None:
        yield displacement_verdict(press.table)
        yield monotonic_verdict(press.scan)
        if design.fruit.bruise_limits_MPa:
            yield bruise_verdict(mean_pressure_estimate(design, press), max(design.fruit.bruise_limits_MPa))
    yield from tip_shape_verdicts(design, press)


def _rows(design: Design, press: ScenePress) -> list[Plain]:
    exact = np.zeros(len(design.tips.springs))  # springs exactly as sized have no error
    return [response_row(press.table, i, design.tips, exact) for i in range(len(press.table.E))]
