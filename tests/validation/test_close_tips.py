"""Two square punches side by side on a half-space: nodes tied by punch tables against boundary elements on both feet.

The elements are graded cells of uniform pressure with the exact potential between rectangles, 16, 22 and 30 a side,
extrapolated at the rate 2: s11 - s12 of unit squares at nu = 0, and its error.
"""

import numpy as np
import pytest

from solve.fruit.footprints import Footprint, level_compliance, nodes_between
from solve.fruit.split import CLOSE, CLOSE_ERROR, NODE_ERROR


@pytest.mark.parametrize(
    ("spacing", "expected", "error"),
    [(1.05, 0.45064235, 5.7e-5), (1.1, 0.49779253, 4.4e-5), (1.2, 0.55299519, 3.5e-5)],
)
def test_close_tips_agree_with_boundary_elements(spacing, expected, error):
    feet = [Footprint(-0.5 * spacing, 0.0, 1.0), Footprint(0.5 * spacing, 0.0, 1.0)]
    S = level_compliance(feet, 0.0, np.zeros(()), nodes_between(feet))
    allowed = NODE_ERROR + (CLOSE_ERROR if spacing < CLOSE else 0.0)
    assert S[0, 0] - S[0, 1] == pytest.approx(expected, rel=allowed + 2.0 * error / expected)
