"""The coefficients of large strain under domes: balls on half-spaces and on balls at finite strain over Hertz's law.

The radius of the contact is 1 throughout, so that one mesh serves all
balls on a fruit. Small strain on the same mesh tells what the finite body gives way, and is Hertz's force exactly: what
the mesh misses cancels. Contact is a penalty at Gauss points of the skin; the rest is the half body of compression.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from unittest.mock import patch

import numpy as np
import pytest
from covering import covers
from scipy.optimize import minimize_scalar
from scipy.sparse import coo_matrix, csc_matrix
from scipy.sparse.linalg import splu

from solve.compression import half_body
from solve.compression.flesh_law import FleshLaw
from solve.compression.half_body import HalfBody, Section
from solve.compression.quadratic import quadratic, quadratic_slope
from solve.contact.domes.large_strain import FIT, FIT_OF_EDGE, large_strain

DOMES = (0.02, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.7)  # contact radius over the dome's
FRUITS = (0.0, 0.05, 0.1)  # contact radius over the fruit's
LARGE = 20.0  # half height and radius of what stands for a half-space
PENALTY = 1e4  # pressure over penetration [E / contact radius]
CELLS = 30  # over 1.25 contact radii: the edge of the contact lies inside one of them
GROWTH = 1.35
REACH = 2.0  # radius within which the skin may touch
POINTS = 8
RESIDUAL = 3e-7  # of the force
SPARE = 6.0  # the constant also holds what other elements find


def graded(first: float, _refinement: float) -> np.ndarray:
    """Return lines from 0 to 1, as many over the contact on every body; `first` is a part of it, over the body."""
    contact = first / half_body._FIRST_ELEMENT
    lines = np.linspace(0.0, 1.25 * contact, CELLS + 1).tolist()
    step = lines[1]
    while lines[-1] < 1.0:
        step *= GROWTH
        lines.append(lines[-1] + step)
    lines = np.array(lines)
    edge = lines[CELLS]
    lines[CELLS:] = edge + (lines[CELLS:] - edge) * (1.0 - edge) / (lines[-1] - edge)
    return lines


def flesh_body(law: FleshLaw, fruit: float) -> HalfBody:
    """Return a body with a curvature, its elements integrated in full: no plate stiffens its modes without energy."""
    with patch.object(half_body, "_graded", graded), patch.object(half_body, "_POINTS", 3):
        if fruit == 0.0:
            return HalfBody(Section(half_height=LARGE, radius=LARGE, is_round=False), law, 1.0)
        # its lines crowd where the section maps the square on a disc
        return HalfBody(Section(half_height=1.0 / fruit, radius=1.0 / fruit), law, np.sqrt(2.0))


@dataclass(frozen=True)
class State:
    """A body under a ball: displacements, penetration, distance and normal at the points, and the energy of both."""

    body: half_body.Deformed
    penetration: np.ndarray
    distance: np.ndarray
    normal: np.ndarray
    energy: float


class Pressed:
    """A body of flesh under balls."""

    def __init__(self, law: FleshLaw, fruit: float) -> None:
        self.body = flesh_body(law, fruit)
        self.fruit = fruit
        self.modulus = 1.0 / (1.0 - law.poisson**2)
        skin = self.body.surface
        self.edges = np.stack([skin[:-2:2], skin[1:-1:2], skin[2::2]], axis=1)
        x = self.body.x[self.edges]
        top = self.body.x[skin[0], 1]
        self.edges = self.edges[(x[:, :, 0].max(axis=1) < REACH) & (x[:, :, 1].min(axis=1) > 0.3 * top)]
        self.top = top
        points, weights = np.polynomial.legendre.leggauss(POINTS)
        self.shapes = quadratic(points)
        x = self.body.x[self.edges]
        self.x = np.einsum("qn,enk->eqk", self.shapes, x)
        along = np.einsum("qn,enk->eqk", quadratic_slope(points), x)
        self.stiffness = PENALTY * np.linalg.norm(along, axis=-1) * weights * 2.0 * np.pi * self.x[..., 0]
        self.level = PENALTY * along[..., 0] * weights * 2.0 * np.pi * self.x[..., 0]  # as seen from above
        self.dofs = (2 * self.edges[:, :, None] + np.arange(2)).reshape(-1, 6)
        self.free = np.flatnonzero(~self.body.held)

    def hertz(self, radius: float, depth: float) -> float:
        return 4.0 / 3.0 * self.modulus * np.sqrt(radius) * depth**1.5

    def step(self, K: csc_matrix, block: np.ndarray, residual: np.ndarray) -> np.ndarray:
        rows = np.repeat(self.dofs, 6, axis=1).ravel()
        columns = np.tile(self.dofs, (1, 6)).ravel()
        total = csc_matrix(K + coo_matrix((block.ravel(), (rows, columns)), shape=K.shape))
        factor = splu(
            csc_matrix(total[self.free][:, self.free]),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
        found = np.zeros(len(residual))
        found[self.free] = factor.solve(-residual[self.free])
        return found.reshape(-1, 2)

    def given_way(self, radius: float, depth: float) -> tuple[float, float]:
        """Return what small strain under a paraboloid has beside Hertz's law.

        That is what the body gives way per force, and the radius of the contact over Hertz's at that force.
        """
        u = np.zeros_like(self.body.x)
        _, K = self.body.tangent(self.body.deformed(u), convex=False)
        gap = 0.5 * self.x[..., 0] ** 2 / radius - depth
        before = None
        for _ in range(50):
            penetration = np.minimum(gap - np.einsum("qn,en->eq", self.shapes, u[self.edges, 1]), 0.0)
            touching = penetration < 0.0
            push = self.level * penetration
            if before is not None and np.array_equal(before, touching):
                break
            before = touching
            forces = np.zeros(2 * self.body.count)
            np.add.at(forces, 2 * self.edges + 1, -np.einsum("eq,qn->en", push, self.shapes))
            block = np.zeros((len(self.edges), 3, 2, 3, 2))
            block[:, :, 1, :, 1] = np.einsum("eq,qn,qm->enm", self.level * touching, self.shapes, self.shapes)
            u = u + self.step(K, block.reshape(-1, 6, 6), K @ u.ravel() + forces)
        force = -push.sum()
        sunk = (force / (4.0 / 3.0 * self.modulus * np.sqrt(radius))) ** (2.0 / 3.0)
        given = float((depth - _mean(push, penetration) - sunk) / force)
        return given, contact_radius(-penetration, self.x[..., 0]) / np.sqrt(radius * sunk)

    def state(self, u: np.ndarray, ball: float, depth: float) -> State:
        deformed = self.body.deformed(u)
        from_centre = self.x + np.einsum("qn,enk->eqk", self.shapes, u[self.edges]) - [0.0, self.top + ball - depth]
        distance = np.linalg.norm(from_centre, axis=-1)
        penetration = np.minimum(np.where(from_centre[..., 1] < 0.0, distance - ball, 1.0), 0.0)
        energy = deformed.energy + 0.5 * float((self.stiffness * penetration**2).sum())
        return State(deformed, penetration, distance, from_centre / distance[..., None], energy)

    def pressed(self, u: np.ndarray, ball: float, depth: float) -> tuple[np.ndarray, float, float]:
        """Return displacements, force and the mean penetration under a ball at a depth, from a start."""
        state = self.state(u, ball, depth)
        for _ in range(60):
            push = self.stiffness * state.penetration
            force = float((push * state.normal[..., 1]).sum())
            contact = np.einsum("eq,eqk,qn->enk", push, state.normal, self.shapes)
            both = state.normal[..., :, None] * state.normal[..., None, :]
            reached = None
            for convex in (False, True):
                forces, K = self.body.tangent(state.body, convex=convex)
                np.add.at(forces, self.dofs.ravel(), contact.ravel())
                residual = np.where(self.body.held, 0.0, forces)
                if np.linalg.norm(residual) <= RESIDUAL * force:
                    return state.body.u, force, _mean(push, state.penetration)
                bend = 0.0 if convex else (push / state.distance)[..., None, None] * (np.eye(2) - both)
                curvature = (self.stiffness * (state.penetration < 0.0))[..., None, None] * both + bend
                block = np.einsum("eqij,qn,qm->enimj", curvature, self.shapes, self.shapes)
                step = self.step(K, block, residual)
                slope = float(residual @ step.ravel())
                for halvings in range(14 if slope < 0.0 else 0):
                    length = 0.5**halvings
                    tried = self.state(state.body.u + length * step, ball, depth)
                    if tried.energy <= state.energy + 1e-4 * length * slope + 1e-13:
                        reached = tried
                        break
                if reached is not None:
                    break
            if reached is None:
                break
            state = reached
        raise ArithmeticError(ball)  # no equilibrium under a ball of so many contact radii


def _mean(push: np.ndarray, penetration: np.ndarray) -> float:
    return float((push * -penetration).sum() / push.sum())


def contact_radius(pressure: np.ndarray, r: np.ndarray) -> float:
    """Return the radius at which pressures of Hertz's root times a polynomial, fitted to those at radii r, end."""
    widest = r[pressure > 0.0].max()
    near = r < 1.3 * widest
    weight = np.sqrt(r[near])

    def left(radius: float) -> float:
        inside = np.minimum(r[near] / radius, 1.0) ** 2
        terms = np.sqrt(1.0 - inside)[:, None] * inside[:, None] ** np.arange(3) * weight[:, None]
        wanted = pressure[near] * weight
        return float(np.linalg.norm(terms @ np.linalg.lstsq(terms, wanted, rcond=None)[0] - wanted))

    found = minimize_scalar(left, bounds=(0.93 * widest, 1.07 * widest), method="bounded", options={"xatol": 1e-6})
    return float(found.x)


def over_hertz(law: FleshLaw, fruit: float, domes: Sequence[float] = DOMES) -> np.ndarray:
    """Return Hertz's contact radii, the force and the contact radius over Hertz's, (domes, 3)."""
    pressed = Pressed(law, fruit)
    u = np.zeros_like(pressed.body.x)
    solved = [(-1.0, u), (0.0, u)]
    rows = []
    for dome in domes:
        radius = 1.0 / (dome + fruit)
        depth = 1.0 / radius
        body, own = pressed.given_way(radius, depth)
        s0, u0 = solved[-2]
        s1, u1 = solved[-1]
        start = u1 + (u1 - u0) * (dome - s1) / (s1 - s0)
        if not np.isfinite(pressed.body.deformed(start).energy):
            start = u1
        u, force, inside = pressed.pressed(start, 1.0 / dome, depth)
        solved.append((dome, u))
        sunk = depth - inside - body * force
        r = pressed.x[..., 0] + np.einsum("qn,en->eq", pressed.shapes, u[pressed.edges, 0])
        edge = contact_radius(-pressed.state(u, 1.0 / dome, depth).penetration, r)
        hertz = np.sqrt(radius * sunk)
        # what mesh and finite body do to the edge at small strain, they do at large
        rows.append((hertz, force / pressed.hertz(radius, sunk), edge / hertz / own))
    return np.array(rows)


def of_bars(poisson: float, fruit: float, domes: Sequence[float] = DOMES) -> tuple[float, float]:
    """Return the largest departures of neo-Hookean forces and contact radii from their fits over their bars [1]."""
    seen = []
    for dome, (hertz, force, edge) in zip(domes, over_hertz(FleshLaw(poisson=poisson), fruit, domes), strict=True):
        fit = large_strain(np.array(hertz), 1.0 / dome, np.array(fruit), poisson)
        seen.append((abs(force - fit.factor) / fit.error, abs(edge - fit.edge) / fit.edge_error))
    of_force, of_edge = np.max(seen, axis=0).tolist()
    return of_force, of_edge


@pytest.mark.study
def test_fit_of_domes_covers_what_other_elements_find():
    """Five domes on a half-space and on a ball; the product was fitted to all of DOMES on FRUITS at five ratios."""
    seen = np.array([of_bars(0.3, fruit, DOMES[:5]) for fruit in FRUITS[:2]])
    assert covers(FIT, FIT * seen[:, 0], SPARE)
    assert covers(FIT_OF_EDGE, FIT_OF_EDGE * seen[:, 1], SPARE)
