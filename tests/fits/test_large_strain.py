"""Constants of curves at large strain, and the table of curves in cad/theory/large_strain.toml."""

import math

import numpy as np
import pytest
from fits.covering import covers

from cad.theory.soft_tissue import large_strain_factor
from solve.large_strain import grid, newton
from solve.large_strain.curve_error import FAR_ELEMENTS, GRIP_OF_STEPS, PENALTY, STEPS
from solve.large_strain.flesh_law import FleshLaw
from solve.large_strain.force_curve import DEPTH_FRACTIONS, REFINEMENTS, force_curve
from solve.large_strain.press import TipPress, pressed
from solve.large_strain.tip_profile import RoundTip

RADIUS = 1.0 / math.sqrt(math.pi)  # of the circle with the area of a square tip


def factors(edge, depths):
    """Return the forces over the linear ones [1] on the finer mesh of a curve, and all that was found."""
    press = TipPress(tip=RoundTip(radius=RADIUS, edge=edge), law=FleshLaw(), refinement=REFINEMENTS[-1])
    found = pressed(press, depths)
    return found.forces / (found.sharp * found.depths), found


@pytest.mark.study
def test_what_a_finer_choice_moves_a_curve_by_is_covered(monkeypatch):
    depths = 0.4 * np.array(DEPTH_FRACTIONS)
    between = 0.5 * (depths + np.append(0.0, depths[:-1]))
    edge = 0.02

    usual, _ = factors(0.0, depths)
    with monkeypatch.context() as stiffer:
        stiffer.setattr(newton, "PENALTY", 10.0 * newton.PENALTY)
        assert covers(PENALTY, np.abs(factors(0.0, depths)[0] - usual))

    usual, found = factors(edge, depths)
    with monkeypatch.context() as finer:
        finer.setattr(grid, "GROWTH", 1.0 + 0.5 * (grid.GROWTH - 1.0))
        assert covers(FAR_ELEMENTS, np.abs(factors(edge, depths)[0] - usual))

    halved, _ = factors(edge, sorted([*depths, *between]))
    of_grip = (found.sharp / found.sliding - 1.0) * edge / RADIUS
    assert covers(STEPS + GRIP_OF_STEPS * of_grip, np.abs(halved[1::2] - usual))


@pytest.mark.parametrize(
    ("law", "poisson"),
    [
        pytest.param("neo-hooke", 0.3, marks=pytest.mark.slow),
        pytest.param("foam", 0.45, marks=pytest.mark.slow),
        *(pytest.param("hencky", poisson, marks=pytest.mark.study) for poisson in (0.15, 0.4, 0.49)),
    ],
)
def test_table_holds_what_its_curves_are(law, poisson):
    """Each row is the curve of a sharp square tip, counted as a circle of its area, down to 0.6 of its side."""
    found = force_curve(RoundTip(radius=RADIUS), FleshLaw(name=law, poisson=poisson), 0.6)
    for depth in (0.1, 0.3, 0.6):
        if depth <= found.reached:
            # 4 decimals are written; round-off may change the path of an iteration, not where it ends.
            assert large_strain_factor(depth, poisson, law) == pytest.approx(float(found.factor(depth)), abs=6e-5)
