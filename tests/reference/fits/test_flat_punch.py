"""Constants of the flat punch at large strain, and the table that it makes: sensor/theory/large_strain.toml."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from covering import covers

from reference.flat_punch import grid, newton
from reference.flat_punch.curve_error import FAR_ELEMENTS, GRIP_OF_STEPS, PENALTY, STEPS
from reference.flat_punch.force_curve import DEPTH_FRACTIONS, REFINEMENTS
from reference.flat_punch.press import TipPress, pressed
from reference.flat_punch.table import RADIUS, table_row
from reference.flat_punch.tip_profile import RoundTip
from solve.compression.flesh_law import FleshLaw

TABLE = Path(__file__).parents[3] / "sensor" / "theory" / "large_strain.toml"


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
        pytest.param("foam", 0.45, marks=pytest.mark.study),
        *(pytest.param("hencky", poisson, marks=pytest.mark.study) for poisson in (0.15, 0.4, 0.49)),
    ],
)
def test_table_holds_what_its_program_finds(law, poisson):
    factors, errors = table_row(law, poisson)
    table = tomllib.loads(TABLE.read_text(encoding="utf-8"))
    row = table["poissons"].index(poisson)
    # 4 decimals are written; round-off may change the path of an iteration, not where it ends.
    assert factors == pytest.approx(table["factors"][law]["rows"][row], abs=6e-5)
    assert errors == pytest.approx(table["errors"][law]["rows"][row], abs=6e-5)
