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
import scipy.sparse
import skfem
from scipy.sparse.linalg import splu

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
DEPTHS = (0.05, 0.1, 0.15)


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


class QuarterBlock:
    """A quarter of the block in 27-node hexahedra of log neo-Hooke, E = 1.

    The tip covers x, y <= 0.5 of the top, z = 0. Displacements are (3 nodes,), the components of a node side by side.
    """

    def __init__(self, sizes: Sizes, poisson: float) -> None:
        inner, outer = 0.5 - graded(sizes, 0.5)[::-1], 0.5 + graded(sizes, HALF_WIDTH - 0.5)
        along = np.concatenate([inner, outer[1:]])
        mesh = skfem.MeshHex.init_tensor(along, along, -graded(sizes, HEIGHT)[::-1])
        basis = skfem.Basis(mesh, skfem.ElementHex2(), intorder=5)
        self.places, self.weights = basis.doflocs, basis.dx  # (3, nodes), (elements, points)
        self.dofs = (3 * basis.element_dofs.T[:, :, None] + np.arange(3)).reshape(len(self.weights), -1)
        self.lam, self.mu = lame_parameters(1.0, poisson)
        slopes = np.stack([np.asarray(function[0].grad) for function in basis.basis])  # (27, 3, elements, points)
        operator = np.zeros((*self.weights.shape, 3, 3, len(slopes), 3))
        for axis in range(3):
            operator[:, :, axis, :, :, axis] = slopes.transpose(2, 3, 1, 0)
        self.operator = operator.reshape(*self.weights.shape, 9, -1)

    def forces(self, u: np.ndarray) -> np.ndarray:
        """Return the forces that hold u."""
        F, F_T, log = self._deformation(u)
        stress = self.mu * (F - F_T) + self.lam * log[..., None, None] * F_T
        stress = (self.weights[..., None, None] * stress).reshape(*self.weights.shape, 9, 1)
        local = (self.operator.transpose(0, 1, 3, 2) @ stress).sum(axis=1)[..., 0]
        return np.bincount(self.dofs.ravel(), local.ravel(), minlength=len(u))

    def tangent(self, u: np.ndarray) -> scipy.sparse.csc_matrix:
        """Return the derivative of the forces: mu dF + (mu - lam ln J) F^-T dF^T F^-T + lam (F^-T : dF) F^-T."""
        _, F_T, log = self._deformation(u)
        turned = np.einsum("eqiL,eqkJ->eqiJkL", F_T, F_T).reshape(*log.shape, 9, 9)
        flat = F_T.reshape(*log.shape, 9)
        A = (self.mu - self.lam * log)[..., None, None] * turned + self.mu * np.eye(9)
        A += self.lam * flat[..., :, None] * flat[..., None, :]
        rows = self.operator.reshape(len(self.weights), -1, self.dofs.shape[1])
        stressed = (self.weights[..., None, None] * A) @ self.operator
        blocks = rows.transpose(0, 2, 1) @ stressed.reshape(rows.shape)
        size = self.dofs.shape[1]
        places = np.repeat(self.dofs, size, axis=1).ravel(), np.tile(self.dofs, (1, size)).ravel()
        return scipy.sparse.coo_matrix((blocks.ravel(), places), shape=(len(u), len(u))).tocsc()

    def _deformation(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return F, its inverse transposed and ln J at all points."""
        slopes = (self.operator @ u[self.dofs][:, None, :, None])[..., 0]
        F = slopes.reshape(*self.weights.shape, 3, 3) + np.eye(3)
        return F, np.linalg.inv(F).swapaxes(-1, -2), np.log(np.linalg.det(F))


def square_forces(poisson: float, depths: Sequence[float], sizes: Sizes) -> tuple[float, np.ndarray, int]:
    """Return the stiffness at small strain, forces at depths, both of E and tip sides, and the number of unknowns."""
    body = QuarterBlock(sizes, poisson)
    x, y, z = np.repeat(body.places, 3, axis=1)
    component = np.tile(np.arange(3), body.places.shape[1])
    face = (z > -1e-9) & (np.maximum(x, y) < 0.5 + 1e-9)
    held = face | (z < 1e-9 - HEIGHT) | ((x < 1e-9) & (component == 0)) | ((y < 1e-9) & (component == 1))
    free, lowered = np.flatnonzero(~held), face & (component == 2)
    u, found, stiffness = np.zeros(len(x)), [], 0.0
    for depth, before in zip(depths, (0.0, *depths), strict=False):
        step = np.where(lowered, before - depth, 0.0)
        for _ in range(MOST_ITERATIONS):
            K, left = body.tangent(u), body.forces(u)
            factor = splu(K[free][:, free], permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
            step[free] = factor.solve(-(left + K @ step)[free])
            if not np.any(u):
                stiffness = -4.0 * float((K @ step)[lowered].sum()) / depth
            u, step = u + step, np.zeros(len(u))
            left = body.forces(u)
            force = -4.0 * float(left[lowered].sum())
            if np.linalg.norm(left[free]) <= SETTLED * force:
                break
        else:
            msg = f"square tip: no equilibrium at {depth:g} tip sides"
            raise RuntimeError(msg)
        found.append(force)
    return stiffness, np.array(found), len(u)


@contextmanager
def same_body(sizes: Sizes):
    """Let the round body have the height and the area of the block, and elements that grow as there."""
    before = grid.BODY_RADIUS, grid.BODY_HEIGHT, grid.SHARP_SIZE, grid.GROWTH
    grid.BODY_RADIUS, grid.BODY_HEIGHT = 2.0 * HALF_WIDTH / math.sqrt(math.pi), HEIGHT
    grid.SHARP_SIZE, grid.GROWTH = sizes.edge, sizes.growth
    try:
        yield
    finally:
        grid.BODY_RADIUS, grid.BODY_HEIGHT, grid.SHARP_SIZE, grid.GROWTH = before


def round_factors(poisson: float, depths: Sequence[float], sizes: Sizes) -> np.ndarray:
    """Return the force over the linear one [1] of the round tip that stands for the square one, without its wall.

    Without a wall flesh folds at the edge as the elements there let it: theirs are as large as the square tip's.
    """
    tip = FlatTip(radius=1.0 / math.sqrt(math.pi), wall=False)
    with same_body(sizes):
        found = pressed(TipPress(tip=tip, law=FleshLaw(poisson=poisson)), depths)
    return found.forces / (found.sharp * found.depths)


def main() -> None:
    """Print the rows of the table."""
    depths = tuple(map(float, sys.argv[1].split(","))) if sys.argv[1:] else DEPTHS
    print("| edge elements, sides | unknowns |", " | ".join(f"square {d:g} | round {d:g}" for d in depths), "|")
    for sizes in MESHES:
        stiffness, forces, unknowns = square_forces(0.3, depths, sizes)
        factors = forces / (stiffness * np.array(depths))
        pairs = zip(factors, round_factors(0.3, depths, sizes), strict=True)
        cells = " | ".join(f"{square:.4f} | {round_one:.4f}" for square, round_one in pairs)
        print(f"| {sizes.edge:g} | {unknowns} | {cells} |", flush=True)


if __name__ == "__main__":
    main()
