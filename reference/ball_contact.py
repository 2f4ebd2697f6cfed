"""A rigid, slippery ball on a cap of neo-Hookean flesh, by finite elements that share nothing with the product.

Quadratic triangles in the section, the law in the tensor form, the skin held to the ball by multipliers at its nodes.
The cap stands on a held base. E = 1, lengths in radii of the contact.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import bmat, csc_matrix
from scipy.sparse.linalg import splu
from skfem import Basis, BilinearForm, ElementTriP2, ElementVector, LinearForm, MeshTri, asm
from skfem.helpers import grad

from sensor.arrays import Flags, Floats, Ints

WIDE = 9.0  # radius and height of the cap
CELLS = 14  # over 1.25 contact radii
GROWTH = 1.3
NEAR = 1.6  # within which the skin may touch
MOST_STEPS = 40  # of Newton's method and the active set together


def parts(u: Any, w: Any) -> Floats:
    """Return the displacement gradient with its hoop part, 3 x 3."""
    H = np.zeros((3, 3, *w.x.shape[1:]))
    H[:2, :2] = grad(u)
    H[2, 2] = u[0] / w.x[0]
    return H


def strained(w: Any) -> tuple[Floats, Floats, Floats]:
    """Return F, its inverse and its determinant J of a form's displacements u; F = 1 where it is not `finite`."""
    F = parts(w["u"], w) * w["finite"] + np.eye(3)[:, :, None, None]
    inverse = np.linalg.inv(F.transpose(2, 3, 0, 1)).transpose(2, 3, 0, 1)  # F^-1
    J = np.linalg.det(F.transpose(2, 3, 0, 1))
    return F, inverse, J


def lame(poisson: float) -> tuple[float, float]:
    """Return Lame's lambda and mu, E = 1."""
    return poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)), 0.5 / (1.0 + poisson)


@BilinearForm
def tangent(du: Any, v: Any, w: Any) -> Floats:
    """Return the second derivative of the neo-Hookean energy density, times r."""
    lam, mu = lame(w["poisson"])
    _, G, J = strained(w)
    A, B = parts(du, w), parts(v, w)
    GA = np.einsum("ij...,jk...->ik...", G, A)
    GB = np.einsum("ij...,jk...->ik...", G, B)
    both = np.einsum("ij...,ji...->...", GA, GB)
    product = np.einsum("ii...->...", GA) * np.einsum("ii...->...", GB)
    return (mu * np.einsum("ij...,ij...->...", A, B) + (mu - lam * np.log(J)) * both + lam * product) * w.x[0]


@LinearForm
def internal(v: Any, w: Any) -> Floats:
    """Return the first derivative of the neo-Hookean energy density, times r: P = mu F + (lambda ln J - mu) F^-T."""
    lam, mu = lame(w["poisson"])
    F, G, J = strained(w)
    P = mu * F + (lam * np.log(J) - mu) * G.swapaxes(0, 1)
    return np.einsum("ij...,ij...->...", P, parts(v, w)) * w.x[0]


def graded(end: float) -> Floats:
    """Return lines from 0 to an end: even over 1.25 contact radii, growing beyond."""
    lines = np.linspace(0.0, 1.25, CELLS + 1).tolist()
    step = lines[1]
    while lines[-1] < end:
        step *= GROWTH
        lines.append(lines[-1] + step)
    lines = np.array(lines)
    lines[CELLS:] = 1.25 + (lines[CELLS:] - 1.25) * (end - 1.25) / (lines[-1] - 1.25)
    return lines


@dataclass(frozen=True)
class Ball:
    """A ball of a radius at a depth; not `finite`: a paraboloid at small strain."""

    radius: float
    depth: float
    finite: float = 1.0

    @property
    def centre(self) -> Floats:
        """Return r and z of the ball's centre, (2, 1)."""
        return np.array([0.0, self.radius - self.depth])[:, None]


@dataclass
class Cap:
    """A cap whose skin has a curvature, in flesh of a Poisson's ratio.

    Of the nodes of the skin that may touch, `skin` (2, n) are the dofs along r and z, and `x` (2, n) the places.
    """

    curvature: float
    poisson: float

    def __post_init__(self) -> None:
        """Bend a rectangle of triangles to the cap, and find its skin and what is held."""
        flat = MeshTri.init_tensor(graded(WIDE), graded(WIDE))
        r, down = flat.p
        fall = 0.5 * self.curvature * r**2 / (0.5 + 0.5 * np.sqrt(1.0 - (self.curvature * r) ** 2))
        mesh = MeshTri(np.stack([r, -fall - down * (1.0 - fall / WIDE)]), flat.t)
        self.basis = Basis(mesh, ElementVector(ElementTriP2()), intorder=4)
        places = self.basis.doflocs

        def dofs_on(nodes: Flags) -> Ints:
            """Return both dofs of nodes and of the edges between them, (2, n)."""
            edges = np.flatnonzero(np.isin(mesh.facets, np.flatnonzero(nodes)).all(axis=0))
            return np.concatenate([self.basis.nodal_dofs[:, nodes], self.basis.facet_dofs[:, edges]], axis=1)

        skin = dofs_on(down == 0.0)
        self.skin = skin[:, places[0, skin[0]] < NEAR]
        self.x = places[:, self.skin[0]]
        self.held = np.union1d(dofs_on(r == 0.0)[0], dofs_on(down == down.max()))

    def force(
        self, ball: float, depth: float, *, finite: float = 1.0, start: Floats | None = None
    ) -> tuple[float, Floats]:
        """Return the force and displacements at a depth of a ball; not `finite`: small strain under a paraboloid.

        Newton's method on displacements and on the pushes of the nodes in contact, which are multipliers. Nodes that
        would pull leave the contact, nodes that enter the ball join it.
        """
        tool = Ball(ball, depth, finite)
        u = np.zeros(self.basis.N) if start is None else start.copy()
        count = self.skin.shape[1]
        active = self.x[0] < 0.95
        push = np.zeros(count)
        free = np.setdiff1d(np.arange(self.basis.N), self.held)
        for _ in range(MOST_STEPS):
            state = {"u": self.basis.interpolate(u), "poisson": self.poisson, "finite": finite}
            K = asm(tangent, self.basis, **state)
            f = asm(internal, self.basis, **state) if finite else K @ u
            normal, gap, bend = self._facing(tool, u)
            chosen = np.flatnonzero(active)
            G, H = self._constraints(normal, -push * bend, chosen)
            A = bmat([[(K + H)[free][:, free], -G[:, free].T], [-G[:, free], None]], format="csc")
            right = np.concatenate([(-f)[free], gap[chosen]])
            solution = splu(A).solve(right)
            step = np.zeros_like(u)
            step[free] = solution[: len(free)]
            u = u + step
            push = np.zeros(count)
            push[chosen] = solution[len(free) :]
            before = active
            active = (active & (push > 0.0)) | (~active & self._entered(tool, u))
            if np.abs(step).max() < 1e-8 and (active == before).all():
                return 2.0 * np.pi * float(-(push * normal[1]).sum()), u
        raise AssertionError("no equilibrium")

    def _facing(self, ball: Ball, u: Floats) -> tuple[Floats, Floats, Floats]:
        """Return outward normals of the ball (2, n), gaps (n,) and slopes of the normals (2, 2, n) at the skin."""
        if ball.finite:
            apart = self.x + u[self.skin] - ball.centre
            distance = np.linalg.norm(apart, axis=0)
            normal = apart / distance
            bend = (np.eye(2)[:, :, None] - normal[:, None] * normal[None]) / distance
            return normal, distance - ball.radius, bend
        count = self.skin.shape[1]
        normal = np.array([[0.0], [-1.0]]) * np.ones(count)
        return normal, self._paraboloid_gap(ball, u), np.zeros((2, 2, count))

    def _paraboloid_gap(self, ball: Ball, u: Floats) -> Floats:
        """Return the gaps (n,) to a paraboloid at small strain."""
        return -u[self.skin[1]] - ball.depth + 0.5 * self.x[0] ** 2 * (1.0 / ball.radius + self.curvature)

    def _entered(self, ball: Ball, u: Floats) -> Flags:
        """Say of each node of the skin whether it is inside the ball."""
        if ball.finite:
            return np.linalg.norm(self.x + u[self.skin] - ball.centre, axis=0) < ball.radius - 1e-9
        return self._paraboloid_gap(ball, u) < -1e-9

    def _constraints(self, normal: Floats, bending: Floats, chosen: Ints) -> tuple[Any, Any]:
        """Return the matrix from displacements to gaps of the chosen nodes, and the slope of their pushes' forces."""
        size = self.basis.N
        rows = np.repeat(np.arange(len(chosen)), 2)
        G = csc_matrix((normal[:, chosen].T.ravel(), (rows, self.skin[:, chosen].T.ravel())), (len(chosen), size))
        values = bending[:, :, chosen]
        i = np.broadcast_to(self.skin[:, None, chosen], values.shape)
        j = np.broadcast_to(self.skin[None, :, chosen], values.shape)
        return G, csc_matrix((values.ravel(), (i.ravel(), j.ravel())), (size, size))

    def contact_radius(self, u: Floats, ball: float, depth: float) -> float:
        """Return where the gap of the pressed skin begins: beside a contact it opens with the power of 3/2."""
        x = self.x + u[self.skin]
        gap = np.linalg.norm(x - np.array([0.0, ball - depth])[:, None], axis=0) - ball
        order = np.argsort(x[0])
        r, gap = x[0][order], gap[order]
        last = np.flatnonzero(gap < 1e-7)[-1]
        beside = slice(last + 2, last + 8)
        roots = np.roots(np.polyfit(r[beside], gap[beside] ** (2.0 / 3.0), 2))
        return float(min(roots.real, key=lambda root: abs(root - r[last])))


def over_hertz(cap: Cap, dome: float) -> tuple[float, float, float]:
    """Return Hertz's contact radius, and force and contact radius over Hertz's, under a ball of a curvature.

    The contact's radius is about 1. Small strain on the same mesh tells what the cap gives way beside Hertz's law.
    """
    radius = 1.0 / (dome + cap.curvature)
    depth = 1.0 / radius
    stiffness = 4.0 / 3.0 / (1.0 - cap.poisson**2) * np.sqrt(radius)
    small, _ = cap.force(1.0 / dome, depth, finite=0.0)
    body = (depth - (small / stiffness) ** (2.0 / 3.0)) / small  # compliance of the cap
    _, start = cap.force(1.0 / dome, 0.5 * depth)
    force, start = cap.force(1.0 / dome, depth, start=start)
    hertz_depth = depth - body * force
    hertz_radius = np.sqrt(radius * hertz_depth)
    edge = cap.contact_radius(start, 1.0 / dome, depth)
    return hertz_radius, force / (stiffness * hertz_depth**1.5), edge / hertz_radius
