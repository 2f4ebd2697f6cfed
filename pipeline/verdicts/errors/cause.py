"""What moves a number beside its numerical error, and the sensor that it moves."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from cad.design.parameters import Design
from cad.theory.two_spring_law import spring_give
from pipeline.springs.fitted_springs import FittedSprings, other_mounts
from pipeline.springs.sizing import SpringSizing
from pipeline.verdicts.characteristic import Characteristic, characteristic
from solve.fruit.compliance import FruitCompliance

PerTip = tuple[float, ...]

BEAM_SLOPES = (3.0, 3.0)  # of ln K over ln t: a beam's, which solids stay under
LEAST_TRAVEL = 1e-6  # [mm] an effect of a smaller travel is taken at this one


@dataclass(frozen=True, kw_only=True)
class Cause:
    """What moves a number: relative changes of each spring and of the fruit under each tip [1], leads of tips [mm].

    `calibrated` says that calibrating the printed unit takes it away.
    """

    effect: str
    reason: str
    springs: PerTip = (0.0, 0.0)
    fruit: PerTip = (0.0, 0.0)
    lead: PerTip = (0.0, 0.0)
    calibrated: bool = False


@dataclass(frozen=True, kw_only=True)
class Sensor:
    """What causes act on: a design with its contact, its sized and its fitted springs, and the law that judges them.

    `mounts` are the relative changes of each spring in other mounts [1], by name; `slopes` those of ln K over ln t of
    the leaves of each spring [1].
    """

    design: Design
    contact: FruitCompliance
    sizing: SpringSizing
    springs: FittedSprings
    own: Characteristic
    mounts: Mapping[str, PerTip]
    slopes: Sequence[float] = BEAM_SLOPES

    def gives(self, K_m: float, travel: float) -> PerTip:
        """Return how far each spring of a level sensor gives at a fruit stiffness [N/mm] and a travel [mm]."""
        travel = max(LEAST_TRAVEL, travel)
        fruit = (K_m, self.own.stiffness_ratio * K_m)
        pairs = zip(self.own.springs.stiffnesses, fruit, strict=True)
        return tuple(spring_give(K, stiffness, travel) for K, stiffness in pairs)

    @property
    def largest_gives(self) -> PerTip:
        """Return how far each spring gives at most [mm], in the scene or level, at full travel."""
        level = self.gives(self.sizing.K_m_at_largest_E, self.design.press.travel_mm)
        return tuple(max(pair) for pair in zip(level, self.springs.deflections, strict=True))


def assessed_sensor(
    design: Design,
    contact: FruitCompliance,
    sizing: SpringSizing,
    springs: FittedSprings,
    mounts: Mapping[str, PerTip] | None = None,
    slopes: Sequence[float] = BEAM_SLOPES,
) -> Sensor:
    """Return what the causes of errors act on; `slopes` are as in `Sensor`.

    `mounts` are the changes of `other_mounts`, which solves for them where they are not given. Causes act on a pair,
    which stands for more tips than two.
    """
    contact, design, springs = contact.per_spring(*design.tips.kinds), design.as_pair, springs.as_pair
    own = characteristic(contact, sizing, springs.stiffnesses, springs.errors)
    mounts = other_mounts(springs) if mounts is None else mounts
    return Sensor(design=design, contact=contact, sizing=sizing, springs=springs, own=own, mounts=mounts, slopes=slopes)
