"""Whole bodies compressed between tools at finite strain, by finite elements that share nothing with the product.

The elements are of fourth order with Gauss-Lobatto nodes and full integration, so that flesh with nu = 0.49 does not
lock. The tangent is computed by finite differences of the stress. Contact with Coulomb friction is enforced by a
penalty at integration points on both ends. The body is a body of revolution, or in plane strain with unit length.
Lengths are in half heights.
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

from sensor.arrays import Flags, Floats, Ints

ORDER = 4  # polynomial order of the elements
END_POINTS = 12  # Gauss points along an element at an end
PENALTY = 1e5  # pressure over penetration [E / half height]
ROUGH = 2  # number of first Newton steps that may raise the residual
MOST_STEPS = 60  # most Newton steps
STICK = 1e5  # friction over sliding distance, for tools that stick
SLID = 5e-4  # sliding distance in which friction nearly reaches its limit [half heights]
GROWTH = (0.0, 0.04, 0.1, 0.18, 0.28, 0.4, 0.65, 1.0)  # mesh lines of a round section, from the axis or the top
PARTS = (0, 2, 4, 6, 8)  # indices of rr, rz, hoop, zr and zz in the nine components of F, row by row
EVEN = tuple(np.linspace(0.0, 1.0, 6) ** 0.7)  # mesh lines of a rectangle, from the axis outwards


def shapes(nodes: Floats, points: Floats) -> tuple[Floats, Floats]:
    """Return the Lagrange polynomials of nodes and their derivatives at points, each (points, nodes)."""
    identity = np.eye(len(nodes))
    interpolator = BarycentricInterpolator(nodes, identity)
    return interpolator(points), interpolator.derivative(points)


def lobatto(order: int) -> Floats:
    """Return the Gauss-Lobatto nodes on [-1, 1], including the ends, (order + 1,)."""
    inner = legendre.Legendre.basis(order).deriv().roots()
    return np.concatenate([[-1.0], np.real(inner), [1.0]])


def stress(F: Floats, law: str, nu: float) -> Floats:
    """Return the first Piola-Kirchhoff stress at F, both (points, 3, 3), with E = 1, by principal stretches."""
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
    """A tool with Coulomb friction: a plate, a ball with the radius `ball`, or a flat plunger with the radius `flat`.

    Infinite friction makes a tool stick.
    """

    friction: float = 0.0
    ball: float = inf
    flat: float = inf

    def rise(self, r: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the distance of the face behind the tip of the tool at radii r, its slope and its curvature."""
        if self.ball == inf:
            return np.zeros_like(r), np.zeros_like(r), np.zeros_like(r)
        root = np.sqrt(np.maximum(self.ball**2 - r**2, 1e-3 * self.ball**2))
        return self.ball - root, r / root, self.ball**2 / root**3


def lines_about_edge(near: float) -> tuple[Floats, Floats]:
    """Return mesh lines across, from 0 to 1, and upwards, from 0 to 1, refined at the edge of a flat plunger.

    `near` is the radius of the plunger over the half width of the body.
    """
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
    """Return the coordinates of the nodes of elements between mesh lines; `base` are the nodes on [-1, 1]."""
    values = [lines[0]]
    for a, b in itertools.pairwise(lines):
        values += (0.5 * (a + b) + 0.5 * (b - a) * base[1:]).tolist()
    return np.array(values)


@dataclass(frozen=True)
class End:
    """One end of a body: its parts from the axis outwards, with their integration points.

    A part has the nodes of one element and the areas of its integration points. `r` (points of all parts,) are the
    radii of these points without load. `sign` is 1 for the upper and -1 for the lower end. `values` (points, nodes) are
    the shape functions of an element along the end.
    """

    parts: list[tuple[Ints, Floats]]
    r: Floats
    sign: float
    values: Floats


class Body:
    """The mesh of a section with half height 1: an ellipse or a rectangle.

    `x` (nodes, 2) are r and z. `w` (elements, points) are volumes at integration points. `B` (elements, points, 5,
    dofs) maps displacements to the `PARTS` of F - 1, and `dofs` (elements, dofs) are the numbers of the displacements.
    `held` are the radial dofs of the axis.
    """

    def __init__(
        self, shape: str, half_width: float, *, plane: bool = False, edge: float | None = None, order: int = ORDER
    ) -> None:
        """Place the nodes, refined at the edge of a flat plunger if `edge` is given, and set up strains and ends.

        `shape` is "round" or a rectangle; with `plane` the body is in plane strain.
        """
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
        blocks = []
        for i in range(len(across) - 1):
            for j in range(len(lines_up) - 1):
                blocks.append(index[order * i : order * i + order + 1, order * j : order * j + order + 1].ravel())
        nodes = np.array(blocks)
        self.w, self.B = self._strains(nodes, base)
        self.dofs = (2 * nodes[..., None] + np.arange(2)).reshape(len(nodes), -1)
        self.held = 2 * index[0]  # the radial dofs of the axis
        self.ends = [self._end(index[:, -1], 1.0, base), self._end(index[:, 0], -1.0, base)]

    def _strains(self, nodes: Ints, base: Floats) -> tuple[Floats, Floats]:
        """Return volumes and strain operator at Gauss points, as `w` and `B` of the class.

        `nodes` are the nodes of the elements, and `base` the nodes on [-1, 1].
        """
        count = len(base)
        gauss, weight = legendre.leggauss(count)
        N, dN = shapes(base, gauss)
        value = np.einsum("pi,qj->pqij", N, N).reshape(count**2, -1)
        d1 = np.einsum("pi,qj->pqij", dN, N).reshape(count**2, -1)
        d2 = np.einsum("pi,qj->pqij", N, dN).reshape(count**2, -1)
        X = self.x[nodes]
        jac = np.stack([np.einsum("qn,end->eqd", d, X) for d in (d1, d2)], axis=-1)
        grad = np.einsum("qnk,eqkd->eqnd", np.stack([d1, d2], axis=-1), np.linalg.inv(jac))
        r = np.einsum("qn,en->eq", value, X[..., 0])
        w = np.linalg.det(jac) * np.outer(weight, weight).ravel() * (1.0 if self.plane else 2.0 * pi * r)
        if self.plane:
            w = 2.0 * w  # includes the mirrored half r < 0
        B = np.zeros((*w.shape, 3, 3, nodes.shape[1], 2))
        B[..., 0, 0, :, 0] = grad[..., 0]
        B[..., 0, 2, :, 0] = grad[..., 1]
        B[..., 2, 0, :, 1] = grad[..., 0]
        B[..., 2, 2, :, 1] = grad[..., 1]
        if not self.plane:
            B[..., 1, 1, :, 0] = value / r[..., None]
        return w, np.ascontiguousarray(B.reshape(*w.shape, 9, -1)[:, :, PARTS])

    def _end(self, row: Ints, sign: float, base: Floats) -> End:
        """Return the end whose nodes, from the axis outwards, are `row`."""
        points, weights = legendre.leggauss(END_POINTS)
        values, slopes = shapes(base, points)
        order = len(base) - 1
        parts = []
        r = []
        for first in range(0, len(row) - 1, order):
            at = row[first : first + order + 1]
            place = values @ self.x[at]
            ds = np.linalg.norm(slopes @ self.x[at], axis=1)
            parts.append((at, weights * ds * (2.0 if self.plane else 2.0 * pi * place[:, 0])))
            r.append(place[:, 0])
        return End(parts, np.concatenate(r), sign, values)


Tools = tuple[Tool, Tool]  # upper, lower
Touched = list[Floats]  # for both ends, r of each point at its last first touch, from which sliding is measured


@dataclass(frozen=True)
class Setup:
    """A body between two tools, with a law of flesh and a Poisson's ratio."""

    body: Body
    tools: Tools
    law: str
    nu: float


@dataclass
class Balance:
    """The residual forces (dofs,), and the entries of their derivative: values, rows and columns."""

    R: Floats
    entries: list[tuple[Floats, Ints, Ints]]


@dataclass(frozen=True)
class Contact:
    """Contact at the points (q,) of one part of an end.

    `touches` marks the points in contact, `push` is the pressure, and `gradient` (2, q) the derivative of the
    penetration over r and z. `curve` is the curvature of the tool's face. `slid` is the outward sliding distance of a
    point since it was touched.
    """

    touches: Flags
    push: Floats
    gradient: Floats
    curve: Floats
    slid: Floats

    def friction(self, friction: float) -> tuple[Floats, Floats]:
        """Return the friction (q,) and its derivative over r and z (2, q), for a coefficient of friction."""
        force = np.zeros_like(self.push)
        slope = np.zeros((2, len(self.push)))
        if friction == inf:
            force = STICK * self.slid
            slope[0] = STICK * self.touches
        elif friction > 0.0:
            root = np.sqrt(self.slid**2 + SLID**2)
            force = friction * self.push * self.slid / root
            slope = friction * PENALTY * self.touches * self.gradient * self.slid / root
            slope[0] += friction * self.push * SLID**2 / root**3
        return force, slope


def pressed(body: Body, tools: Tools, travels: Sequence[float] | Floats, law: str, nu: float) -> Floats:
    """Return the force [E x half height^2] at travels of the upper tool [half heights]; tools are (upper, lower).

    If no equilibrium is found at a travel, the step from the last one is halved. Raises RuntimeError for tiny steps.
    """
    setup = Setup(body, tools, law, nu)
    u = np.zeros(body.x.size)
    previous = u.copy()
    at = before = 0.0
    touched = [end.r.copy() for end in body.ends]
    forces = []
    for travel in travels:
        target = travel
        while at < travel - 1e-14:
            if at == 0.0:
                start = u.copy()
                start[1::2] -= target * 0.5 * (1.0 + body.x[:, 1])
            else:
                start = u + (u - previous) * (target - at) / (at - before)
            solution = newton(setup, target, start, touched)
            if solution is None:
                target = 0.5 * (at + target)
                if target - at < 1e-6:
                    msg = f"no equilibrium at {travel}"
                    raise RuntimeError(msg)
                continue
            previous, before = u, at
            u, force, touched = solution
            at, target = target, travel
        forces.append(force)
    return np.array(forces)


def newton(setup: Setup, travel: float, start: Floats, touched: Touched) -> tuple[Floats, float, Touched] | None:
    """Return displacements, force and touched points in equilibrium at a travel; None if none is found.

    A step that raises the residual is halved, because points may enter or leave the contact in a full step.
    """
    size = setup.body.x.size
    u = start.copy()
    u[setup.body.held] = 0.0
    free = np.setdiff1d(np.arange(size), setup.body.held)
    last = inf
    base = u
    move = u
    length = 0.0
    for iteration in range(MOST_STEPS):
        balance = flesh_balance(setup, u)
        if balance is None:
            return None
        force, touched_now = add_contact(balance, setup, travel, u, touched)
        norm = float(np.linalg.norm(balance.R[free]))
        if iteration and norm < 1e-7 * max(abs(force), 1e-5):
            return u, force, touched_now
        if iteration > ROUGH and norm > last and length > 0.1:
            length *= 0.5
            u[free] = base + length * move
            continue
        last = norm
        values, rows, columns = (np.concatenate(part) for part in zip(*balance.entries, strict=True))
        matrix = coo_matrix((values, (rows, columns)), shape=(size, size)).tocsc()[free][:, free]
        move = splu(matrix).solve(-balance.R[free])
        largest = np.abs(move).max()
        if not np.isfinite(largest):
            return None
        length = min(1.0, 0.2 / largest)  # no node moves more than a fifth of the half height
        base = u[free]
        u[free] = base + length * move
    return None


def flesh_balance(setup: Setup, u: Floats) -> Balance | None:
    """Return the forces of the flesh at displacements and their derivative; None if an element is inverted.

    The derivative of the stress is a central difference over each component of F.
    """
    body = setup.body
    elements, points = body.w.shape
    operator = body.B.reshape(elements, 5 * points, -1)
    F = np.zeros((elements * points, 9))
    F[:, PARTS] = (operator @ u[body.dofs][:, :, None]).reshape(-1, 5)
    F = F.reshape(-1, 3, 3) + np.eye(3)
    if np.linalg.det(F).min() <= 0.0:
        return None
    P = stress(F, setup.law, setup.nu).reshape(elements, points, 9)[:, :, PARTS]
    A = np.zeros((elements, points, 5, 5))
    h = 1e-6
    for column, part in enumerate(PARTS):
        step = np.zeros(9)
        step[part] = h
        up = stress(F + step.reshape(3, 3), setup.law, setup.nu) - stress(F - step.reshape(3, 3), setup.law, setup.nu)
        A[..., column] = up.reshape(elements, points, 9)[:, :, PARTS] / (2.0 * h) * body.w[:, :, None]
    transposed = np.swapaxes(operator, 1, 2)
    f = transposed @ (P * body.w[:, :, None]).reshape(elements, -1, 1)
    K = transposed @ (A @ body.B).reshape(elements, 5 * points, -1)
    R = np.bincount(body.dofs.ravel(), f.ravel(), minlength=u.size).astype(np.float64, copy=False)
    n = body.dofs.shape[1]
    return Balance(R, [(K.ravel(), np.repeat(body.dofs, n, axis=1).ravel(), np.tile(body.dofs, (1, n)).ravel())])


def add_contact(
    balance: Balance, setup: Setup, travel: float, u: Floats, touched: Touched
) -> tuple[float, list[Floats]]:
    """Add the contact at both ends to a balance, and return the force on the upper tool and the new touched points."""
    force = 0.0
    touched_now = []
    for tool, end, before in zip(setup.tools, setup.body.ends, touched, strict=True):
        now = before.copy()
        tip = 1.0 - travel if end.sign > 0 else -1.0
        first = 0
        for at, area in end.parts:
            rows = slice(first, first + len(area))
            first += len(area)
            r = end.values @ (setup.body.x[at, 0] + u[2 * at])
            z = end.values @ (setup.body.x[at, 1] + u[2 * at + 1])
            rise, slope, curve = tool.rise(r)
            depth = end.sign * (z - tip) - rise
            touches = (depth > 0.0) & (end.values @ setup.body.x[at, 0] <= tool.flat)
            push = PENALTY * np.where(touches, depth, 0.0)
            force += float((area * push).sum()) if end.sign > 0 else 0.0
            now[rows] = np.where(touches, before[rows], r)
            gradient = np.stack([-slope, np.full_like(slope, end.sign)])
            contact = Contact(touches, push, gradient, curve, r - np.where(touches, before[rows], r))
            _add_part(balance, contact, tool.friction, (at, area), end.values)
        touched_now.append(now)
    return force, touched_now


def _add_part(balance: Balance, contact: Contact, friction: float, part: tuple[Ints, Floats], values: Floats) -> None:
    """Add the contact of one part of an end to a balance: the penalty energy 1/2 k depth^2 and friction."""
    at, area = part
    gradient = contact.gradient
    sideways, sideways_slope = contact.friction(friction)
    loads = [contact.push * gradient[0] + sideways, contact.push * gradient[1]]
    k = PENALTY * contact.touches * gradient[:, None] * gradient[None, :]
    k[0, 0] -= contact.push * contact.curve
    k[0] += sideways_slope
    for i in range(2):
        np.add.at(balance.R, 2 * at + i, values.T @ (area * loads[i]))
        for j in range(2):
            block = values.T @ ((area * k[i, j])[:, None] * values)
            rows = np.repeat(2 * at + i, len(at))
            columns = np.tile(2 * at + j, len(at))
            balance.entries.append((block.ravel(), rows, columns))
