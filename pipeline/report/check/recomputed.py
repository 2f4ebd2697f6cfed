"""What a report says of fruit and springs as the types of a run again, and the verdicts that follow from them."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cad.design.parameters import Design
from cad.design.printability import Printable, check_printable
from cad.parts.housing import Housing
from cad.quantity import Estimate
from cad.verdict import Verdict
from pipeline.options import RunOptions
from pipeline.report.mapping import STIFFNESS_VERDICTS
from pipeline.response.scene_press import press_scan, scene_of
from pipeline.springs.fitted_spring import FittedSpring
from pipeline.springs.fitted_springs import NAMES, FittedSprings
from pipeline.springs.sizing import SpringSizing, spring_sizing
from pipeline.storage.plain import Plain, number_at, value_at
from pipeline.verdicts.rules import monotonic_verdict, printable_verdict, stiffness_verdict, target_verdicts
from pipeline.verdicts.targets import characteristic
from solve.error_estimate import SolveInfo
from solve.fruit.compliance import FruitCompliance


@dataclass(frozen=True, kw_only=True, eq=False)
class Recomputed:
    """What a report's other numbers follow from: the fruit's compliance, the sizing by it, and the springs as made.

    C is the compliance of the tips by their springs, shape (tips, tips) [mm/N].
    """

    design: Design
    housing: Housing | None
    contact: FruitCompliance
    sizing: SpringSizing
    springs: FittedSprings
    C: NDArray[np.float64]

    @property
    def level(self) -> bool:
        """Say whether the scene is a level sensor on flat fruit, whose tips the weight leaves level."""
        return scene_of(self.design).linear and self.design.press.attitude == "side"


def recomputed(report: Plain, design: Design, housing: Housing | None) -> Recomputed:
    """Return what a report says of fruit and springs; raises ValueError, ArithmeticError for numbers of none."""
    contact = _compliance(report)
    basis = value_at(report, "springs.fruit_stiffness")
    sizing = spring_sizing(design, contact, RunOptions(fruit_stiffness=basis))
    springs = FittedSprings(
        springs=_springs(report, sizing, _printable(design, sizing, housing)),
        process=design.process,
        deflections=sizing.deflections(design.full_travels_mm),
        fitted=None,
    )
    C = springs.C
    if housing is not None:
        C[0, -1] = C[-1, 0] = number_at(report, "behaviour.crosstalk_C12_over_C22") * C[-1, -1]
    return Recomputed(design=design, housing=housing, contact=contact, sizing=sizing, springs=springs, C=C)


def _compliance(report: Plain) -> FruitCompliance:
    return FruitCompliance(
        S=np.array(value_at(report, "contact.compliance_per_mm"), dtype=np.float64),
        error_pair=0.01 * number_at(report, "contact.error_percent"),
        error_own=0.01 * number_at(report, "contact.s11_error_percent"),
        info=SolveInfo(method="stored", dofs=0, seconds=0.0, status="read from a report"),
    )


def _printable(design: Design, sizing: SpringSizing, housing: Housing | None) -> tuple[Printable, ...]:
    """Return whether the process can make the leaves, at the lengths of the housing where there is one."""
    lengths = None if housing is None else tuple(arm.flexure.length for arm in housing.arms)
    process, ratio = design.process, sizing.sizing_stiffness_ratio
    return check_printable(design, sizing.springs, sizing.K_m_max, process, lengths, ratio)


def _springs(report: Plain, sizing: SpringSizing, printable: tuple[Printable, ...]) -> tuple[FittedSpring, ...]:
    springs = []
    for i, name in enumerate(NAMES):
        key = f"flexures.{name}"
        spring = FittedSpring(
            name=name,
            target=sizing.springs.stiffnesses[i],
            printable=printable[i],
            K=_estimate(report, f"{key}.stiffness_N_per_m", f"{key}.error_percent", 1e-3),
            root_strain=_estimate(report, f"{key}.root_strain", f"{key}.root_strain_error_percent", 1.0),
        )
        springs.append(spring)
    return tuple(springs)


def _estimate(report: Plain, value: str, percent: str, factor: float) -> Estimate | None:
    """Return a number with its error in per cent, times a factor; None where the report has none."""
    if value_at(report, value) is None:
        return None
    number = factor * number_at(report, value)
    return Estimate(number, 0.01 * number_at(report, percent) * abs(number))


def expected_verdicts(found: Recomputed) -> Iterator[Verdict]:
    """Yield the verdicts that follow from compliance and stiffnesses: P_max, NL, springs, leaves, P rising."""
    springs, housing = found.springs, found.housing
    own = characteristic(found.contact, found.sizing, springs.stiffnesses, springs.errors)
    targets = found.design.nominal_targets
    yield from target_verdicts(own.P_max(), own.NL(targets), targets, manufactured=housing is not None)
    monolithic = housing is None or (housing.gauges == "none" and not housing.pin_side)
    for name, spring in zip(STIFFNESS_VERDICTS, springs.springs, strict=True):
        yield stiffness_verdict(name, spring, monolithic=monolithic)
    if housing is not None:
        yield from (printable_verdict(spring) for spring in springs.springs)
    if found.level:
        yield monotonic_verdict(press_scan(found.design, found.contact, found.C))
