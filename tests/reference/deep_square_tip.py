"""A square tip pressed deep into flesh in three dimensions, glued and sharp: what the round tip stands for.

An independent solve: 27-node hexahedra over a quarter of a block, log neo-Hooke, Newton's method from depth to depth.
Nothing stops the flesh at the side wall, neither here nor under the round tip beside it, on a round body of the same
area. `python tests/reference/deep_square_tip.py` (minutes) prints the table of docs/accuracy.md.
"""

import math
import sys
from collections.abc import Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import skfem
from scipy.sparse.linalg import splu
from skfem.helpers import ddot, det, grad, identity, inv, mul, transpose

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT)]

from solve.elasticity import lame_parameters  # noqa: E402
from solve.large_strain import grid  # noqa: E402
from solve.large_strain.flesh_law import FleshLaw  # noqa: E402
from solve.large_strain.press import TipPress, pressed  # noqa: E402
from solve.large_strain.tip_profile import FlatTip  # noqa: E402

HALF_WIDTH, HEIGHT = 4.0, 4.0  # of the block [tip sides]
SETTLED = 1e-8  # of the force
MOST_ITERATIONS = 12
DEPTHS = (0.05, 0.1)


@dataclass(frozen=True, kw_only=True)
class Sizes:
    """The size of the elements at the tip's edge [tip sides], and their growth from one to the next."""

    edge: float
    growth: float


MESHES = (Sizes(edge=0.12, growth=2.4), Sizes(edge=0.08, growth=2.2), Sizes(edge=0.05, growth=1.9))


def graded(sizes: Sizes, length: float) -> np.ndarray:
    """Return lines from 0 to a length, each step larger than the one before."""
    count = math.ceil(math.log1p(length / sizes.edge * (sizes.growth - 1.0)) / math.log(sizes.growth))
    lines = np.concatenate([[0.0], np.cumsum(sizes.edge * sizes.growth ** np.arange(count))])
    return lines * (length / lines[-1])


def quarter(sizes: Sizes) -> skfem.Basis:
    """Return the elements of a quarter of the block; the tip covers x, y <= 0.5 of the top, z = 0."""
    inner, outer = 0.5 - graded(sizes, 0.5)[::-1], 0.5 + graded(sizes, HALF_WIDTH - 0.5)
    along = np.concatenate([inner, outer[1:]])
    mesh = skfem.MeshHex.init_tensor(along, along, -graded(sizes, HEIGHT)[::-1])
    return skfem.Basis(mesh, skfem.ElementVector(skfem.ElementHex2()), intorder=5)


def components(basis: skfem.Basis) -> np.ndarray:
    """Return along which axis each dof moves, (dofs,)."""
    found = np.empty(basis.N, dtype=int)
    for kind in (basis.dofs.nodal_dofs, basis.dofs.edge_dofs, basis.dofs.facet_dofs, basis.dofs.interior_dofs):
        for component, dofs in enumerate(kind):
            found[dofs] = component
    return found


def neo_hooke(poisson: float) -> tuple[skfem.BilinearForm, skfem.LinearForm]:
    """Return the tangent and the forces of log neo-Hooke with E = 1 at displacements `w["u"]`."""
    lam, mu = lame_parameters(1.0, poisson)

    @skfem.BilinearForm
    def tangent(u, v, w):
        F = grad(w["u"]) + identity(grad(w["u"]))
        F_T = transpose(inv(F))
        turned = mul(mul(F_T, transpose(grad(u))), F_T)
        of_volume = lam * ddot(F_T, grad(u)) * ddot(F_T, grad(v))
        return mu * ddot(grad(u), grad(v)) + (mu - lam * np.log(det(F))) * ddot(turned, grad(v)) + of_volume

    @skfem.LinearForm
    def forces(v, w):
        F = grad(w["u"]) + identity(grad(w["u"]))
        F_T = transpose(inv(F))
        return ddot(mu * (F - F_T) + lam * np.log(det(F)) * F_T, grad(v))

    return tangent, forces


def square_forces(poisson: float, depths: Sequence[float], sizes: Sizes) -> tuple[float, np.ndarray, int]:
    """Return the stiffness at small strain, forces at depths, both of E and tip sides, and the number of unknowns."""
    tangent, forces = neo_hooke(poisson)
    basis = quarter(sizes)
    (x, y, z), component = basis.doflocs, components(basis)
    face = (z > -1e-9) & (np.maximum(x, y) < 0.5 + 1e-9)
    held = face | (z < 1e-9 - HEIGHT) | ((x < 1e-9) & (component == 0)) | ((y < 1e-9) & (component == 1))
    free, lowered = np.flatnonzero(~held), face & (component == 2)
    u, found, stiffness = np.zeros(basis.N), [], 0.0
    for depth, before in zip(depths, (0.0, *depths), strict=False):
        step = np.where(lowered, before - depth, 0.0)
        for _ in range(MOST_ITERATIONS):
            here = basis.interpolate(u)
            K, left = tangent.assemble(basis, u=here).tocsc(), forces.assemble(basis, u=here)
            step[free] = splu(K[free][:, free], permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}).solve(
                -(left + K @ step)[free]
            )
            if not np.any(u):
                stiffness = -4.0 * float((K @ step)[lowered].sum()) / depth
            u, step = u + step, np.zeros(basis.N)
            left = forces.assemble(basis, u=basis.interpolate(u))
            force = -4.0 * float(left[lowered].sum())
            if np.linalg.norm(left[free]) <= SETTLED * force:
                break
        else:
            msg = f"square tip: no equilibrium at {depth:g} tip sides"
            raise RuntimeError(msg)
        found.append(force)
    return stiffness, np.array(found), basis.N


@contextmanager
def same_body():
    """Let the round body have the height and the area of the block."""
    before = grid.BODY_RADIUS, grid.BODY_HEIGHT
    grid.BODY_RADIUS, grid.BODY_HEIGHT = 2.0 * HALF_WIDTH / math.sqrt(math.pi), HEIGHT
    try:
        yield
    finally:
        grid.BODY_RADIUS, grid.BODY_HEIGHT = before


def round_factors(poisson: float, depths: Sequence[float]) -> np.ndarray:
    """Return the force over the linear one [1] of the round tip that stands for the square one, without its wall."""
    tip = FlatTip(radius=1.0 / math.sqrt(math.pi), wall=False)
    with same_body():
        found = pressed(TipPress(tip=tip, law=FleshLaw(poisson=poisson), refinement=2), depths)
    return found.forces / (found.sharp * found.depths)


def main() -> None:
    """Print the rows of the table."""
    depths = tuple(map(float, sys.argv[1].split(","))) if sys.argv[1:] else DEPTHS
    print("| mesh | unknowns |", " | ".join(f"d {depth:g}" for depth in depths), "|")
    print("| round tip | - |", " | ".join(f"{factor:.4f}" for factor in round_factors(0.3, depths)), "|")
    for sizes in MESHES:
        stiffness, forces, unknowns = square_forces(0.3, depths, sizes)
        factors = forces / (stiffness * np.array(depths))
        print(
            f"| edge {sizes.edge:g} | {unknowns} |", " | ".join(f"{factor:.4f}" for factor in factors), "|", flush=True
        )


if __name__ == "__main__":
    main()
