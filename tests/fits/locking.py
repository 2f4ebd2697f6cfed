"""LOCKING: what three meshes of quadratic tetrahedra leave as nu tends to 0.5, direct against split.

`python tests/fits locking` (3 minutes) solves the paper's block on the product's own three meshes. What they
leave at nu 0.3, where nothing locks, is their extrapolation's and is taken off.
"""

import dataclasses
from collections.abc import Sequence
from functools import cache

from fits.comparison import Comparison, covering
from skfem import Mesh

from cad.design.parameters import Fruit, Tips
from cad.parts.fruit import solved_block
from mesh.fruit import REFINEMENTS, fruit_mesh
from solve.fruit.direct import direct_compliance, locking
from solve.fruit.split import split_compliance

TIPS = Tips()
POISSON = (0.45, 0.49, 0.499, 0.4999)
FREE = 0.3
SPARE = 4.0  # the power law lies 1.7 to 3.4 times above what is seen


@cache
def meshes(refinements: tuple[float, ...]) -> tuple[Mesh, ...]:
    fruit = Fruit()
    return tuple(fruit_mesh(solved_block(fruit, TIPS), fruit, TIPS, scale) for scale in refinements)


@cache
def apart(poisson: float, refinements: tuple[float, ...]) -> float:
    """Return by how much s11 - s12 of direct exceeds that of the split [1]."""
    fruit = dataclasses.replace(Fruit(), poisson=poisson)
    direct, split = direct_compliance(meshes(refinements), poisson).S, split_compliance(fruit, TIPS).S
    return float((direct[0][0] - direct[0][1]) / (split[0][0] - split[0][1]) - 1.0)


def compared(poissons: Sequence[float] = POISSON, refinements: tuple[float, ...] = REFINEMENTS) -> list[Comparison]:
    free = apart(FREE, refinements)
    return [
        covering(f"locking at nu {nu:g}", locking(nu), [abs(apart(nu, refinements) - free)], SPARE) for nu in poissons
    ]
