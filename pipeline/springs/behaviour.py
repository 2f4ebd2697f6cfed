"""How the printed springs behave beside their stiffness: tilt, crosstalk, stiffening, frequency."""

from dataclasses import dataclass

import numpy as np

from cad.parts.housing import Arm, Housing
from pipeline.response.scene_press import ScenePress
from pipeline.springs.arm_behaviour import ArmBehaviour
from pipeline.springs.fitted_springs import FittedSprings
from pipeline.springs.leaf_lengths import FittedHousing
from sensor.arrays import Floats
from sensor.record import Record
from sensor.theory.elastica import large_deflection_stiffening
from sensor.theory.leaf_spring import Flexure, natural_frequency

LONGEST_FRACTION = 0.5  # of the length of a leaf: the largest deflection that the elastica takes


@dataclass(frozen=True, kw_only=True, repr=False)
class SpringBehaviour(Record):
    """The behaviour of every spring by its name, and one tip under the force of the other [1]."""

    crosstalk: float
    arms: dict[str, ArmBehaviour]


def spring_behaviour(springs: FittedSprings, press: ScenePress) -> SpringBehaviour | None:
    """Return the behaviour at full travel; None where nothing is made."""
    fitted = springs.fitted
    if fitted is None:
        return None
    arms = {}
    for i, arm in enumerate(fitted.housing.arms):
        tips = list(springs.tips.spring_groups[i])
        forces_at_full_travel = press.table.F[:, -1, tips]
        arms[arm.name] = _arm_behaviour(springs, fitted, i, float(forces_at_full_travel.max()))
    C = fitted.stiffness.C
    crosstalk = float(C[0, -1] / C[-1, -1])
    return SpringBehaviour(crosstalk=crosstalk, arms=arms)


def _arm_behaviour(springs: FittedSprings, fitted: FittedHousing, i: int, force: float) -> ArmBehaviour:
    """Return the behaviour of one spring, by its index, under the largest force of its tips [N].

    The frequency is Rayleigh's quotient, a formula.
    """
    arm = fitted.housing.arms[i]
    stiffness = fitted.stiffness
    K = stiffness.K[i]
    return ArmBehaviour(
        tilt_at_full_force_rad=float(stiffness.tilt_per_N[i]) * force,
        large_deflection_stiffening=float(stiffening(arm.flexure, springs.deflections[i])),
        natural_frequency_Hz=_frequency(fitted.housing, arm, K, springs),
    )


def stiffening(flexure: Flexure, deflection: Floats | float) -> Floats:
    """Return the stiffening of a spring from first touch to deflections [mm] [1], at most that at half L."""
    return large_deflection_stiffening(flexure.length, np.minimum(deflection, LONGEST_FRACTION * flexure.length))


def _frequency(housing: Housing, arm: Arm, K: float, springs: FittedSprings) -> float:
    """Return the first frequency [Hz] of a shuttle of block, tapered neck and tip on its leaves."""
    section = housing.shuttle_width * housing.depth
    tip_face = housing.tip_side**2
    block_volume = section * (arm.top_level - housing.neck_level)
    tip_volume = tip_face * housing.tip_height
    # The neck is a truncated pyramid from the section of the block to the face of the tip.
    neck_height = housing.neck_level - housing.tip_height
    neck_volume = neck_height * (section + tip_face + (section * tip_face) ** 0.5) / 3.0
    leaf = arm.flexure
    density = 1e-3 * springs.process.density_g_per_cm3  # g/mm^3
    shuttle_mass = density * (block_volume + neck_volume + tip_volume)
    leaf_mass = density * leaf.thickness * leaf.length * leaf.depth
    return natural_frequency(K, shuttle_mass, leaf_mass)
