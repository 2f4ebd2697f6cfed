"""Whole bodies between tools at finite strain, by finite elements that share nothing with the product.

Nodes of Gauss and Lobatto, of fourth order, all points integrated, so that flesh of nu 0.49 does not lock; the tangent
by differences of the stress; contact by penalty at the integration points of both ends of the whole body, with
Coulomb's friction. The body is one of revolution, or of 1 mm length in plane strain. Lengths are in half heights.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, pi

import numpy as np
from numpy.polynomial import legendre
from scipy.interpolate import BarycentricInterpolator
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import splu

from sensor.arrays import Floats

ORDER = 4
PENALTY = 1e5
ROUGH = 2  # first steps may raise the residual
STICK = 1e5
SLID = 5e-4  # half heights, over which friction comes up to its limit
GROWTH = (0.0, 0.04, 0.1, 0.18, 0.28, 0.4, 0.65, 1.0)
PARTS = (0, 2, 4, 6, 8)  # rr, rz, hoop, zr, zz of F in rows
EVEN = tuple(np.linspace(0.0, 1.0, 6) ** 0.7)


def shapes(nodes: Floats, points: Floats) -> tuple[Floats, Floats]:
    """Return Lagrange's functions of nodes and their slopes at points, (points, nodes) each."""
    identity = np.eye(len(nodes))
    interpolator = BarycentricInterpolator(nodes, identity)
    return interpolator(points), interpolator.derivative(points)


def lobatto(order: int) -> Floats:
    inner = legendre.Legendre.basis(order).deriv().roots()
    return np.concatenate([[-1.0], np.real(inner), [1.0]])


def stress(F: Floats, law: str, nu: float) -> Floats:
    """Return P (points, 3, 3) at F (points, 3, 3), E = 1, from the principal stretches."""
    mu = 0.5 / (1.0 + nu)
    lam = nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    squares, N = np.linalg.eigh(np.swapaxes(F, 1, 2) @ F)
    stretch = np.sqrt(squares)
    J = stretch.prod(axis=1, keepdims=True)
    if law == "neo-hooke":
        kirchhoff = mu * (stretch**2 - 1.0) + lam * np.log(J)
    elif law == "hencky":
        kirchhoff = 2.0 * mu * np.log(stretch) + lam * np.log(J)
    else:
        kirchhoff = 0.5 * mu * (stretch**4 - J ** (-4.0 * nu / (1.0 - 2.0 * nu)))
    return np.einsum("qij,qja,qa,qka->qik", F, N, kirchhoff / squares, N)


@dataclass
class Tool:
    """A plate, a ball of a radius, or a flat plunger of a radius, with Coulomb's friction."""

    friction: float = 0.0
    ball: float = inf
    flat: float = inf

    def rise(self, r: Floats) -> tuple[Floats, Floats, Floats]:
        """Return how far the tool's face lies behind its tip at r, its slope and curvature."""
        if self.ball == inf:
            return np.zeros_like(r), np.zeros_like(r), np.zeros_like(r)
        root = np.sqrt(np.maximum(self.ball**2 - r**2, 1e-3 * self.ball**2))
        return self.ball - root, r / root, self.ball**2 / root**3


def lines_about_edge(near: float) -> tuple[Floats, Floats]:
    """Return lines across and upward [1], close to each other about the edge of a flat plunger."""
    ladder = np.array([0.0, 0.03, 0.12, 0.4, 1.0])
    inner = near * (1.0 - ladder[::-1])
    outer = [near * (1.0 + step) for step in ladder]
    while outer[-1] < 0.93:
        outer.append(outer[-1] + 1.2 * near)
    across = np.unique(np.concatenate([inner, [line for line in outer if line < 0.93], [1.0]]))
    upper = [1.0]
    step = 0.04 * near
    while upper[-1] > 0.05:
        upper.append(upper[-1] - step)
        step = min(2.5 * step, 0.4)
    return across, np.array([*upper[:-1], 0.0])[::-1]


def refined(lines: Floats, base: Floats) -> Floats:
    """Return the nodes of elements between lines."""
    values = [lines[0]]
    for a, b in itertools.pairwise(lines):
        values += (0.5 * (a + b) + 0.5 * (b - a) * base[1:]).tolist()
    return np.array(values)


class Body:
    """A section of half height 1: an ellipse or a rectangle of a half width."""

    def __init__(
        self, shape: str, half_width: float, *, plane: bool = False, edge: float | None = None, order: int = ORDER
    ) -> None:
        self.plane = plane
        round_ = shape == "round"
        across = np.array(GROWTH if round_ else EVEN)
        upper = 1.0 - across[::-1] if round_ else np.linspace(0.0, 1.0, 6) ** 0.8
        if edge is not None:
            across, upper = lines_about_edge(edge / half_width)
        lines_up = np.concatenate([-upper[:0:-1], upper])
        base = lobatto(order)

        a, b = np.meshgrid(refined(across, base), refined(lines_up, base), indexing="ij")
        if round_:
            x = half_width * a * np.sqrt(1.0 - 0.5 * b**2)
            z = b * np.sqrt(1.0 - 0.5 * a**2)
        else:
            x = half_width * a
            z = b
        self.x = np.stack([x.ravel(), z.ravel()], axis=1)
        index = np.arange(x.size).reshape(x.shape)
        n = order
        blocks = []
        for i in range(len(across) - 1):
            for j in range(len(lines_up) - 1):
                blocks.append(index[n * i : n * i + n + 1, n * j : n * j + n + 1].ravel())
        nodes = np.array(blocks)
        gauss, weight = legendre.leggauss(n + 1)
        N, dN = shapes(base, gauss)
        value = np.einsum("pi,qj->pqij", N, N).reshape((n + 1) ** 2, -1)
        d1 = np.einsum("pi,qj->pqij", dN, N).reshape((n + 1) ** 2, -1)
        d2 = np.einsum("pi,qj->pqij", N, dN).reshape((n + 1) ** 2, -1)
        X = self.x[nodes]
        jac = np.stack([np.einsum("qn,end->eqd", d, X) for d in (d1, d2)], axis=-1)
        grad = np.einsum("qnk,eqkd->eqnd", np.stack([d1, d2], axis=-1), np.linalg.inv(jac))
        r = np.einsum("qn,en->eq", value, X[..., 0])
        self.w = np.linalg.det(jac) * np.outer(weight, weight).ravel() * (1.0 if plane else 2.0 * pi * r)
        if plane:
            self.w = 2.0 * self.w  # the other half
        B = np.zeros((*self.w.shape, 3, 3, nodes.shape[1], 2))
        B[..., 0, 0, :, 0] = grad[..., 0]
        B[..., 0, 2, :, 0] = grad[..., 1]
        B[..., 2, 0, :, 1] = grad[..., 0]
        B[..., 2, 2, :, 1] = grad[..., 1]
        if not plane:
            B[..., 1, 1, :, 0] = value / r[..., None]
        self.B = np.ascontiguousarray(B.reshape(*self.w.shape, 9, -1)[:, :, PARTS])
        self.dofs = (2 * nodes[..., None] + np.arange(2)).reshape(len(nodes), -1)
        self.held = 2 * index[0]
        # both ends
        points, weights = legendre.leggauss(12)
        M, dM = shapes(base, points)
        self.ends = []
        for row, sign in ((index[:, -1], 1.0), (index[:, 0], -1.0)):
            parts = []
            edges = []
            for i in range(len(across) - 1):
                at = row[n * i : n * i + n + 1]
                place = M @ self.x[at]
                ds = np.linalg.norm(dM @ self.x[at], axis=1)
                area = weights * ds * (2.0 if plane else 2.0 * pi * place[:, 0])
                parts.append((at, area))
                edges.append(place)
            self.ends.append((parts, np.concatenate(edges), sign, M))


Tools = tuple[Tool, Tool]


def pressed(body: Body, tools: Tools, travels: Sequence[float] | Floats, law: str, nu: float) -> Floats:
    """Return the force [E x half height^2] at travels of the upper tool [half heights]; tools are (upper, lower)."""
    u = np.zeros(body.x.size)
    previous = u.copy()
    at = before = 0.0
    ref = [end[1][:, 0].copy() for end in body.ends]
    forces = []
    for travel in travels:
        target = travel
        while at < travel - 1e-14:
            if at == 0.0:
                start = u.copy()
                start[1::2] -= target * 0.5 * (1.0 + body.x[:, 1])
            else:
                start = u + (u - previous) * (target - at) / (at - before)
            solution = newton(body, tools, target, law, nu, start, ref)
            if solution is None:
                target = 0.5 * (at + target)
                if target - at < 1e-6:
                    msg = f"no equilibrium at {travel}"
                    raise RuntimeError(msg)
                continue
            previous, before = u, at
            u, force, ref = solution
            at, target = target, travel
        forces.append(force)
    return np.array(forces)


def newton(  # noqa: C901 - one iteration, from the stress to the step
    body: Body, tools: Tools, travel: float, law: str, nu: float, start: Floats, ref: list[Floats]
) -> tuple[Floats, float, list[Floats]] | None:
    size = body.x.size
    u = start.copy()
    u[body.held] = 0.0
    free = np.setdiff1d(np.arange(size), body.held)
    last = inf
    base = u
    move = u
    length = 0.0
    for iteration in range(60):
        elements, points = body.w.shape
        operator = body.B.reshape(elements, 5 * points, -1)
        F = np.zeros((elements * points, 9))
        F[:, PARTS] = (operator @ u[body.dofs][:, :, None]).reshape(-1, 5)
        F = F.reshape(-1, 3, 3) + np.eye(3)
        if np.linalg.det(F).min() <= 0.0:
            return None
        P = stress(F, law, nu).reshape(elements, points, 9)[:, :, PARTS]
        A = np.zeros((elements, points, 5, 5))
        h = 1e-6
        for column, part in enumerate(PARTS):
            step = np.zeros(9)
            step[part] = h
            up = stress(F + step.reshape(3, 3), law, nu) - stress(F - step.reshape(3, 3), law, nu)
            A[..., column] = up.reshape(elements, points, 9)[:, :, PARTS] / (2.0 * h) * body.w[:, :, None]
        transposed = np.swapaxes(operator, 1, 2)
        f = transposed @ (P * body.w[:, :, None]).reshape(elements, -1, 1)
        K = transposed @ (A @ body.B).reshape(elements, 5 * points, -1)
        R = np.bincount(body.dofs.ravel(), f.ravel(), minlength=size)
        n = body.dofs.shape[1]
        entries = [(K.ravel(), np.repeat(body.dofs, n, axis=1).ravel(), np.tile(body.dofs, (1, n)).ravel())]
        force = 0.0
        news = []
        for tool, (parts, _, sign, M), reference in zip(tools, body.ends, ref, strict=True):
            new = reference.copy()
            first = 0
            for at, area in parts:
                rows = slice(first, first + len(area))
                first += len(area)
                r = M @ (body.x[at, 0] + u[2 * at])
                z = M @ (body.x[at, 1] + u[2 * at + 1])
                rise, slope, curve = tool.rise(r)
                tip = 1.0 - travel if sign > 0 else -1.0
                depth = sign * (z - tip) - rise
                touch = (depth > 0.0) & (M @ body.x[at, 0] <= tool.flat)
                push = PENALTY * np.where(touch, depth, 0.0)
                force += float((area * push).sum()) if sign > 0 else 0.0
                # energy 1/2 k depth^2: gradient along (r, z) is push (-slope, sign)
                d = np.stack([-slope, np.full_like(slope, sign)])
                tr = np.zeros_like(push)
                ktr = np.zeros((2, len(push)))
                slid = r - np.where(touch, reference[rows], r)
                if tool.friction == inf:
                    tr = STICK * slid
                    ktr[0] = STICK * touch
                elif tool.friction > 0.0:
                    root = np.sqrt(slid**2 + SLID**2)
                    tr = tool.friction * push * slid / root
                    ktr = tool.friction * PENALTY * touch * d * slid / root
                    ktr[0] += tool.friction * push * SLID**2 / root**3
                new[rows] = np.where(touch, reference[rows], r)
                loads = [push * d[0] + tr, push * d[1]]
                k = PENALTY * touch * d[:, None] * d[None, :]
                k[0, 0] -= push * curve
                k[0] += ktr
                for i in range(2):
                    np.add.at(R, 2 * at + i, M.T @ (area * loads[i]))
                    for j in range(2):
                        block = M.T @ ((area * k[i, j])[:, None] * M)
                        entries.append(
                            (
                                block.ravel(),
                                np.repeat(2 * at + i, len(at)),
                                np.tile(2 * at + j, len(at)),
                            )
                        )
            news.append(new)
        norm = float(np.linalg.norm(R[free]))
        if iteration and norm < 1e-7 * max(abs(force), 1e-5):
            return u, force, news
        if iteration > ROUGH and norm > last and length > 0.1:  # nodes go in and out of contact: a shorter step
            length *= 0.5
            u[free] = base + length * move
            continue
        last = norm
        values, rows_, columns = (np.concatenate(part) for part in zip(*entries, strict=True))
        matrix = coo_matrix((values, (rows_, columns)), shape=(size, size)).tocsc()[free][:, free]
        move = splu(matrix).solve(-R[free])
        largest = np.abs(move).max()
        if not np.isfinite(largest):
            return None
        length = min(1.0, 0.2 / largest)
        base = u[free]
        u[free] = base + length * move
    return None
