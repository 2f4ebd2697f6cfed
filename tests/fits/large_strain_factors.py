"""cad/theory/large_strain.toml: forces over the linear ones of a sharp tip that grips, by three laws of flesh.

`python tests/fits large_strain_factors` (1 minute) writes the file.
"""

import math
from pathlib import Path

import numpy as np
from fits.comparison import Comparison

from cad.theory.soft_tissue import FLESH_LAWS
from solve.large_strain.flesh_law import FleshLaw
from solve.large_strain.force_curve import ForceCurve, force_curve
from solve.large_strain.tip_profile import RoundTip

DATA = Path(__file__).parents[2] / "cad" / "theory" / "large_strain.toml"
POISSONS = (0.0, 0.15, 0.3, 0.4, 0.45, 0.49)
DEPTHS = (0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6)
SQUARE = RoundTip(radius=1.0 / math.sqrt(math.pi))  # the circle with the area of a square tip


def curve(law: FleshLaw) -> ForceCurve:
    """Return the curve of a law down to the deepest of the depths."""
    return force_curve(SQUARE, law, DEPTHS[-1])


def written(curves: dict[str, list[ForceCurve]]) -> str:
    """Return the text of the file."""
    lines = [
        "# Force of a square tip over the linear one [1] by depth [tip sides], Poisson's ratio and law of flesh: sharp",
        "# edge, no slip, the side wall does not rub. Rows end where no equilibrium was found; errors are those of FE.",
        "# Made by tests/fits/large_strain_factors.py.",
        f"depths = {list(DEPTHS)}",
        f"poissons = {list(POISSONS)}",
    ]
    for quantity in ("factor", "error"):
        for name, each in curves.items():
            lines += ["", f'[{quantity}s."{name}"]', "rows = ["]
            lines += [f"    {_row(getattr(one, quantity)(reached(one)))}," for one in each]
            lines.append("]")
    return "\n".join(lines) + "\n"


def reached(found: ForceCurve) -> np.ndarray:
    """Return the depths that were solved [tip sides]."""
    return np.array([depth for depth in DEPTHS if depth <= found.reached * (1.0 + 1e-9)])


def _row(values: np.ndarray) -> str:
    return "[" + ", ".join(f"{value:.4f}" for value in values) + "]"


def compared() -> list[Comparison]:
    """Write the file anew; there is no constant to compare."""
    curves = {name: [curve(FleshLaw(name=name, poisson=poisson)) for poisson in POISSONS] for name in FLESH_LAWS}
    DATA.write_text(written(curves), encoding="utf-8")
    return []
