"""The springs as they are printed: leaves that fit the targets, or the reason why the process cannot make them."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from cad.design.parameters import Design
from cad.design.printability import Printable, check_printable
from cad.design.processes import PROCESSES, Process
from cad.parts.housing import Housing
from cad.parts.layout import housing_for
from cad.quantity import InputError
from cad.theory.flexure import Flexure
from cad.theory.two_spring_law import Springs
from mesh.session import MeshError
from pipeline.accuracy import DEFAULT_TOLERANCE
from pipeline.fit.leaf_lengths import FittedFlexures
from pipeline.stages.kept import kept_flexures
from pipeline.stages.sizing import Sizing
from solve.contact.linear_response import spring_compliance
from solve.linear import SolveError

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class PrintedSpring:
    """One spring: its target and FE stiffness [N/mm], its leaf [mm], the strain at its root at full travel [1]."""

    name: str
    target: float
    printable: Printable
    flexure: Flexure | None = None
    stiffness: float | None = None
    error_percent: float | None = None
    root_strain: float | None = None
    strain_error_percent: float | None = None
    safety_factor: float | None = None


@dataclass(frozen=True, kw_only=True)
class PrintedSprings:
    """Both springs, the process, and where both can be made the housing and its FE result."""

    low: PrintedSpring
    high: PrintedSpring
    process: Process
    deflections: tuple[float, float]
    fitted: FittedFlexures | None

    @property
    def housing(self) -> Housing | None:
        """Return the housing, None when a spring cannot be made."""
        return None if self.fitted is None else self.fitted.housing

    @property
    def plain(self) -> bool:
        """Say whether the springs are of one piece: no gauges glued on, no pins."""
        return self.housing is None or (self.housing.gauges == "none" and not self.housing.pin_side)

    @property
    def stiffnesses(self) -> Springs:
        """Return the stiffnesses found by FE, or the targets where nothing was made [N/mm]."""
        K_l, K_h = (spring.target if spring.stiffness is None else spring.stiffness for spring in (self.low, self.high))
        return Springs(K_l=K_l, K_h=K_h)

    @property
    def errors(self) -> tuple[float, float]:
        """Return the error of each stiffness [N/mm]; 0 for a target."""
        K = self.stiffnesses
        low, high = (0.01 * (spring.error_percent or 0.0) for spring in (self.low, self.high))
        return low * K.K_l, high * K.K_h

    @property
    def compliance(self) -> Floats:
        """Return the compliance of both tips by their springs, shape (2, 2) [mm/N]."""
        if self.fitted is not None:
            return self.fitted.stiffness.C
        return spring_compliance(self.stiffnesses.K_l, self.stiffnesses.K_h)


def print_springs(design: Design, sizing: Sizing, tolerance: float = DEFAULT_TOLERANCE) -> PrintedSprings:
    """Return the springs of a design, fitted by FE to the relative tolerance unless the beam law rules one out.

    A leaf near a bound is judged again at its solved length; where no mesh or no fit is found, both are undecided.
    """
    process = PROCESSES[design.print.process]
    springs, K_m_max, asymmetry = sizing.springs, sizing.K_m_max, sizing.sized_asymmetry
    deflections = sizing.deflections(design.full_travels_mm)
    verdicts = check_printable(design, springs, K_m_max, process, asymmetry=asymmetry)
    fitted = None
    if all(verdict.passed is not False for verdict in verdicts):
        lengths = (verdicts[0].length_mm, verdicts[1].length_mm)
        try:
            guess = housing_for(design, process, lengths, deflections)
            targets, material = (springs.K_l, springs.K_h), (process.E_MPa, process.poisson)
            fitted = kept_flexures(guess, targets, material, tolerance)
        except (InputError, MeshError, SolveError) as error:
            low_verdict, high_verdict = (replace(one, passed=None, reason=str(error)) for one in verdicts)
            verdicts = (low_verdict, high_verdict)
        else:
            solved = (fitted.housing.low.length, fitted.housing.high.length)
            verdicts = check_printable(design, springs, K_m_max, process, solved, asymmetry)
    low, high = (_spring(index, springs, verdicts[index], fitted, deflections[index]) for index in (0, 1))
    return PrintedSprings(low=low, high=high, process=process, deflections=deflections, fitted=fitted)


def _spring(
    index: int, springs: Springs, verdict: Printable, fitted: FittedFlexures | None, deflection: float
) -> PrintedSpring:
    name, target = (("low", springs.K_l), ("high", springs.K_h))[index]
    if fitted is None:
        return PrintedSpring(name=name, target=target, printable=verdict)
    result = fitted.stiffness
    strain = result.K[index] * deflection * result.strain_per_N[index]
    return PrintedSpring(
        name=name,
        target=target,
        printable=verdict,
        flexure=(fitted.housing.low, fitted.housing.high)[index],
        stiffness=result.K[index],
        error_percent=result.error_percent[index],
        root_strain=strain,
        strain_error_percent=result.strain_error_percent[index],
        safety_factor=verdict.strain_limit / strain if strain > 0.0 else None,
    )
