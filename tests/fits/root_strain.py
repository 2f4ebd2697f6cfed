"""STRAIN_ERROR_SHARE: error of the root strain over what continuing it to the edges of the elements adds.

`python tests/fits root_strain` (3 minutes): six processes on meshes of scale 1 against scale 0.5.
"""

from collections.abc import Sequence

import numpy as np
from fits.comparison import Comparison, covering
from fits.springs import EVERY, Case, solved

from solve.housing.stiffness import STRAIN_ERROR_SHARE

FINE, REFERENCE = 1.0, 0.5


def shares(case: Case) -> np.ndarray:
    """Return the error of the largest strain over what continuing it adds [1], shape (2,)."""
    fine, truth = solved(case, FINE), np.array(solved(case, REFERENCE).strain_per_N)
    strain, inside = np.array(fine.strain_per_N), np.array(fine.strain_inside_per_N)
    return np.abs(strain - truth) / (strain - inside)


def compared(cases: Sequence[Case] = EVERY) -> list[Comparison]:
    return [covering("STRAIN_ERROR_SHARE", STRAIN_ERROR_SHARE, np.concatenate([shares(case) for case in cases]))]
