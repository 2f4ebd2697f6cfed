"""One spring as it is printed, or the reason why the process cannot make it; and both as the beam law has them."""

from dataclasses import dataclass

from cad.design.parameters import Design
from cad.design.printability import Printable, check_printable
from cad.quantity import Estimate
from cad.theory.leaf_spring import Flexure
from pipeline.springs.sizing import SpringSizing


@dataclass(frozen=True, kw_only=True)
class FittedSpring:
    """One spring: its target stiffness [N/mm], whether it can be printed, and where it is made what FE gives.

    K [N/mm] is its stiffness; `root_strain` [1] is that at the root of its leaves at full travel.
    """

    name: str
    target: float
    printable: Printable
    flexure: Flexure | None = None
    K: Estimate | None = None
    root_strain: Estimate | None = None

    @property
    def stiffness(self) -> float:
        """Return the stiffness by FE, the target where it is not made [N/mm]."""
        return self.target if self.K is None else self.K.value

    @property
    def error(self) -> float:
        """Return the error of the stiffness [N/mm]; 0 for a target."""
        return 0.0 if self.K is None else self.K.error

    @property
    def safety_factor(self) -> float | None:
        """Return the strain limit over the root strain [1]; None where it is not made or not bent."""
        strain = self.root_strain
        return self.printable.strain_limit / strain.value if strain is not None and strain.value > 0.0 else None


def springs_as_sized(design: Design, sizing: SpringSizing) -> tuple[FittedSpring, ...]:
    """Return springs just as stiff as they were sized or given [N/mm], low then high, none of them made.

    The beam law gives the length of their leaves, and says whether the process can print these.
    """
    process, ratio = design.process, sizing.sizing_stiffness_ratio
    printable = check_printable(design, sizing.springs, sizing.K_m_max, process, stiffness_ratio=ratio)
    rows = zip(design.tips.as_pair.names, sizing.springs.stiffnesses, printable, strict=True)
    return tuple(FittedSpring(name=name, target=K, printable=leaves) for name, K, leaves in rows)
