"""_lift: by how much the stiffness on the coarse mesh lies above that on a finer one, over length / depth of the leaf.

`python tests/fits coarse_mesh` (20 s) fits a / (1 + b L / w) to six processes on meshes of scale 2 and 1.
"""

from collections.abc import Sequence

import numpy as np
from fits.comparison import Comparison, covering, fitted
from fits.springs import EVERY, Case, stiffness
from scipy.optimize import curve_fit

from pipeline.springs import leaf_lengths

FINE = 1.0
AS_A_RULE = 5e-4  # of the stiffness: what the docstring of _lift promises
SHORT, LONG = 1.4, 10.0  # L / w of the leaves that are fitted


def lifts(case: Case) -> np.ndarray:
    """Return K coarse over K fine less 1 of both springs [1], shape (2,)."""
    return stiffness(case, leaf_lengths.COARSE) / stiffness(case, FINE) - 1.0


def slendernesses(case: Case) -> np.ndarray:
    return np.array(case.lengths) / case.housing.depth


def in_code(case: Case) -> np.ndarray:
    return np.array([leaf_lengths._lift(arm.flexure) - 1.0 for arm in case.housing.arms])


def law(x: np.ndarray, a: float, b: float) -> np.ndarray:
    return a / (1.0 + b * x)


def compared(cases: Sequence[Case] = EVERY) -> list[Comparison]:
    x, measured = (np.concatenate([of(case) for case in cases]) for of in (slendernesses, lifts))
    code = np.concatenate([in_code(case) for case in cases])
    (a, b), _ = curve_fit(law, x, measured, p0=(3e-3, 0.5))
    scatter = float(np.abs(measured - law(x, a, b)).max())
    places = np.argmin(np.abs(x - SHORT)), np.argmin(np.abs(x - LONG))
    return [
        *(fitted(f"_lift at L / w {x[i]:.3g}", code[i], law(x[i], a, b), scatter) for i in places),
        covering(f"_lift, to within (fit {a:.4f} / (1 + {b:.3g} L / w))", AS_A_RULE, np.abs(measured - code)),
    ]
