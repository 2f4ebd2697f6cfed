"""Two square punches side by side on a half-space: nodes tied by punch tables against boundary elements on both feet.

The elements are cells of uniform pressure with the exact potential between rectangles, on three grids, extrapolated.
"""

from functools import cache

import numpy as np
import pytest

from reference.extrapolation import richardson
from solve.fruit.footprints import Footprint, level_compliance, nodes_between
from solve.fruit.split import CLOSE_SPACING, CLOSE_SPACING_ERROR, NODE_ERROR
from solve.halfspace.punch import graded_edges, influence

GRIDS = (16, 22, 30)


@cache
def cells_pressed_against_each_other(spacing, cells):
    """Return s11 - s12 at nu = 0 of unit squares under uniform cells."""
    y = graded_edges(cells)
    x = np.concatenate([y - 0.5 * spacing, y + 0.5 * spacing])
    on_feet = np.delete(np.arange(2 * cells + 1), cells)  # the cell between the feet carries nothing
    pairs = influence(x, y)[np.ix_(on_feet, on_feet)].transpose(0, 2, 1, 3).reshape(2 * cells**2, -1)
    area = np.outer(np.diff(x)[on_feet], np.diff(y)).ravel()
    tips = np.kron(np.eye(2), np.ones((cells**2, 1)))
    stiffness = tips.T @ np.linalg.solve(pairs / np.outer(area, area), tips)
    compliance = np.linalg.inv(stiffness)
    return float(compliance[0, 0] - compliance[0, 1])


@pytest.mark.parametrize("spacing", [1.05, 1.1, 1.2])
def test_close_tips_agree_with_boundary_elements(spacing):
    values = [cells_pressed_against_each_other(spacing, cells) for cells in GRIDS]
    reference = richardson(values, [1.0 / cells for cells in GRIDS], expected_rate=2.0)
    feet = [Footprint(-0.5 * spacing, 0.0, 1.0), Footprint(0.5 * spacing, 0.0, 1.0)]
    nodes = nodes_between(feet)
    S = level_compliance(feet, 0.0, np.zeros((2 * nodes**2, 2 * nodes**2)), nodes)
    allowed = NODE_ERROR + (CLOSE_SPACING_ERROR if spacing < CLOSE_SPACING else 0.0)
    assert abs((S[0, 0] - S[0, 1]) / reference.value - 1.0) <= allowed + 2.0 * reference.error / reference.value
    assert reference.error / reference.value < 2e-4
