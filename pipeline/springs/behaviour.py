"""The behaviour of printed springs beyond their stiffness: tilt, crosstalk, stiffening and frequency."""

import numpy as np

from pipeline.response.scene_press import ScenePress
from pipeline.springs.behaviour_record import ArmBehaviour, SpringBehaviour
from pipeline.springs.fitted_springs import FittedSprings
from sensor.arrays import Floats
from sensor.theory.elastica import large_deflection_stiffening
from sensor.theory.leaf_spring import Flexure, natural_frequency

LONGEST_FRACTION = 0.5  # largest deflection for which the elastica is evaluated, as a fraction of the leaf's length


def spring_behaviour(springs: FittedSprings, press: ScenePress) -> SpringBehaviour | None:
    """Return the tilt, stiffening, natural frequency and crosstalk of the printed springs; None without a housing.

    The tilt is computed for the largest force on a tip of each spring in `press` at full travel. The stiffening is
    computed for the deflection of the spring at full travel. The natural frequency is Rayleigh's quotient of a shuttle
    on its leaves, in closed form.
    """
    fitted = springs.fitted
    if fitted is None:
        return None
    housing = fitted.housing
    stiffness = fitted.stiffness
    density = 1e-3 * springs.process.density_g_per_cm3  # [g/mm^3]
    arms = {}
    for i, arm in enumerate(housing.arms):  # the low spring first, as in the other arrays
        tips_on_spring = list(springs.tips.spring_groups[i])
        force = float(press.table.F[:, -1, tips_on_spring].max())  # over all moduli, at full travel [N]
        leaf = arm.flexure
        leaf_mass = density * leaf.thickness * leaf.length * leaf.depth
        arms[arm.name] = ArmBehaviour(
            tilt_at_full_force_rad=float(stiffness.tilt_per_N[i]) * force,
            large_deflection_stiffening=float(stiffening(leaf, springs.deflections[i])),
            natural_frequency_Hz=natural_frequency(stiffness.K[i], density * housing.shuttle_volume(arm), leaf_mass),
        )
    C = stiffness.C  # compliance of one plate [mm/N], with the low tip first and the high tip last
    return SpringBehaviour(crosstalk_C12_over_C22=float(C[0, -1] / C[-1, -1]), **arms)


def stiffening(flexure: Flexure, deflection: Floats | float) -> Floats:
    """Return the relative increase of a spring's stiffness [1] at large deflections [mm], by the elastica.

    The result has the shape of `deflection`. The elastica is evaluated up to a deflection of half the length of the
    leaf. At larger deflections, the increase is assumed to be constant.
    """
    return large_deflection_stiffening(flexure.length, np.minimum(deflection, LONGEST_FRACTION * flexure.length))
