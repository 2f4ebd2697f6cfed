"""How a design fares with ideal springs: every verdict that needs neither solids nor meshes of the housing."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

from cad.design.fruit import Fruit
from cad.design.parameters import Design
from cad.design.tips import Tips
from cad.quantity import Estimate
from cad.verdict import Verdict, failed
from pipeline.options import RunOptions
from pipeline.reading.placed import refuse_unsolvable_presses
from pipeline.reading.sensor_readings import assess_readings
from pipeline.report.solids import NO_LINE
from pipeline.response.contact import contact_compliance
from pipeline.response.scene_press import TRAVELS, ScenePress, press_scene, pressed_at, scene_of
from pipeline.springs.fitted_springs import FittedSprings, ideal_springs
from pipeline.springs.sizing import SpringSizing, spring_sizing
from pipeline.verdicts.characteristic import characteristic
from pipeline.verdicts.reading_rules import reading_verdicts
from pipeline.verdicts.rules import (
    bruise_verdict,
    displacement_verdict,
    monotonic_verdict,
    printable_verdict,
    target_verdicts,
)
from pipeline.verdicts.scene_targets import scene_targets
from pipeline.verdicts.sensor import bruise_verdicts
from pipeline.verdicts.tip_shape import flat_shape_verdicts, tip_face_verdict
from solve.fruit.compliance import FruitCompliance

ROUGH = 0.005  # relative error of the compliance that is enough to try a change
# Costs of the parts of a trial, in hundredths of a second of a processor where they were measured.
_SCENE, _ASSESSMENT, _QUICK, _CURVE = 1, 20, 40, 200
_FLAT_CONTACT, _CURVED_CONTACT = 8, 60
_NO_NUMBER = 3.0  # how far a verdict without a number counts as off


@dataclass(frozen=True, kw_only=True)
class Trial:
    """A design with the verdicts that its ideal springs would get."""

    design: Design
    verdicts: tuple[Verdict, ...]

    @property
    def passes(self) -> bool:
        """Say whether every verdict passes."""
        return not self.wrong

    @property
    def wrong(self) -> tuple[Verdict, ...]:
        """Return the verdicts that do not pass."""
        return tuple(verdict for verdict in self.verdicts if verdict.passed is not True)

    @property
    def distance(self) -> float:
        """Return how far the verdicts that do not pass are off, all together [1]: to say which trial comes nearest."""
        return sum(1.0 + _excess(verdict) for verdict in self.wrong)


def _excess(verdict: Verdict) -> float:
    """Return how far a verdict is off in steps of its tolerance, as a logarithm [1]."""
    value, limit, tolerance = verdict.value, verdict.limit, verdict.tolerance
    if value is None:
        return _NO_NUMBER
    if not isinstance(limit, int | float) or not isinstance(tolerance, int | float):
        return 0.0
    allowed = max(tolerance * abs(limit) if verdict.relative else tolerance, 0.01 * abs(limit), 1e-9)
    return min(_NO_NUMBER, math.log1p(abs(value - limit) / allowed))


class Trials:
    """Tries designs, keeps what it solved of their fruits, and counts what that cost.

    `ahead` is how far each tip of the design that failed stands before the foremost one by its weight [mm].
    """

    def __init__(self, budget: int, ahead: tuple[float, ...] = ()) -> None:
        """Start with nothing solved and a budget in hundredths of a processor second."""
        self.left = budget
        self.count = 0
        self._ahead = ahead
        self._contacts: dict[tuple[Fruit, Tips], FruitCompliance] = {}

    def allow(self, least: int) -> None:
        """See that at least so much of the budget is left."""
        self.left = max(self.left, least)

    def remember(self, design: Design, contact: FruitCompliance) -> None:
        """Keep a compliance that was solved for a design."""
        self._contacts[_of_contact(design)] = contact

    def __call__(self, design: Design) -> Trial:
        """Return the trial of a design; raises InputError, SolveError or MeshError where it cannot be tried."""
        self.count += 1
        self.left -= _SCENE
        refuse_unsolvable_presses(design)
        contact = self._contact(design)
        sizing = spring_sizing(design, contact, RunOptions())
        springs = ideal_springs(design, sizing)
        printable = (*(printable_verdict(spring) for spring in springs.springs), *_of_the_layout(design))
        if design.reading is not None:
            return Trial(design=design, verdicts=(*printable, *self._of_readings(design, contact, springs)))
        return Trial(design=design, verdicts=(*printable, *self._of_the_ratio(design, contact, sizing, springs)))

    def _contact(self, design: Design) -> FruitCompliance:
        key = _of_contact(design)
        if key not in self._contacts:
            self.left -= _FLAT_CONTACT if design.fruit.shape == "block" else _CURVED_CONTACT
            self._contacts[key] = contact_compliance(design.fruit, design.tips, "split", ROUGH)
        return self._contacts[key]

    def _of_readings(self, design: Design, contact: FruitCompliance, springs: FittedSprings) -> tuple[Verdict, ...]:
        """Return the verdicts on readings; flat tips that tilt are too dear to try, and none is known to pass."""
        self.left -= _ASSESSMENT
        if not design.tips.tip_shape.obeys_hertz:
            return (failed("reading.bias", "tips with a dome", unit="1", reference="readings of flat tips"),)
        press = press_scene(design, contact, springs.C)
        found = reading_verdicts(design, assess_readings(design, contact, springs))
        return (*found, tip_face_verdict(design, press))

    def _of_the_ratio(
        self, design: Design, contact: FruitCompliance, sizing: SpringSizing, springs: FittedSprings
    ) -> tuple[Verdict, ...]:
        """Return the verdicts on P; where contact is solved on cells, on few moduli first and on all if those pass."""
        ahead = self._ahead if design.press.attitude != "side" else ()
        if not scene_of(design, ahead).linear and not design.tips.tip_shape.obeys_hertz:
            self.left -= _QUICK
            quick = tuple(_at_the_ends(design, contact, springs, ahead))
            if any(verdict.passed is not True for verdict in quick):
                return quick
            self.left -= _CURVE
        press = press_scene(design, contact, springs.C, ahead)
        return tuple(_of_the_press(design, contact, sizing, springs, press))


def _of_the_layout(design: Design) -> tuple[Verdict, ...]:
    """Return geometry.layout for a line, geometry.tip_shape for tips that cannot be printed."""
    if design.tips.layout == "line":
        return (NO_LINE,)
    return () if design.tips.tip_shape.obeys_hertz else flat_shape_verdicts(design.tips)


def _of_contact(design: Design) -> tuple[Fruit, Tips]:
    """Return of a design what its compliance times E depends on."""
    plain = Fruit()
    fruit = replace(design.fruit, E_max_MPa=plain.E_max_MPa, E_MPa=plain.E_MPa, bruise_limit_MPa=None)
    return fruit, replace(design.tips, gap_mm=Tips().gap_mm, socket="none")


def _at_the_ends(
    design: Design, contact: FruitCompliance, springs: FittedSprings, ahead: tuple[float, ...]
) -> Iterator[Verdict]:
    """Yield the verdicts on P_max, on the spread of P and on bruising by the least and the largest modulus alone."""
    moduli = sorted({min(design.fruit.E_MPa), design.fruit.E_max_MPa})
    table = pressed_at(scene_of(design, ahead), contact, springs.C, moduli, TRAVELS)
    yield displacement_verdict(table)
    last = table.P[:, -1]
    P_max = Estimate(float(last[-1]), 0.0) if math.isfinite(last[-1]) else None
    if design.targets is not None:
        yield target_verdicts(P_max, None, design.targets)[0]
    limits = design.fruit.bruise_limits_MPa
    if limits:
        yield bruise_verdict(Estimate(float(table.F[-1, -1].max()) / design.tips.face_mm2, 0.0, "MPa"), max(limits))


def _of_the_press(
    design: Design, contact: FruitCompliance, sizing: SpringSizing, springs: FittedSprings, press: ScenePress
) -> Iterator[Verdict]:
    """Yield the verdicts on P_max, NL, the spread of P, its rise, bruising and the faces of domes."""
    contact, springs = contact.of_kinds(*design.tips.kinds), springs.as_pair
    own = characteristic(contact, sizing, springs.stiffnesses)
    if design.targets is not None:
        reached = scene_targets(own, design.targets, contact, springs.C, press)
        yield from target_verdicts(reached.P_max, reached.NL, design.targets)
    yield displacement_verdict(press.table)
    yield monotonic_verdict(press.scan)
    yield from bruise_verdicts(design, contact, springs, press)
    if design.tips.tip_shape.obeys_hertz:
        yield tip_face_verdict(design, press)
