"""Solid models of fruit with skin: a body of revolution under a central round tip, and a block under a cube.

They do not use the theory of a layered half-space: the skin consists of elements with another modulus. The elements
are quadratic and graded to the edge of the contact. The tip is rigid and frictionless, and the base is clamped. Lengths
are in mm, and the modulus of the flesh is 1.
"""

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import bmat, csr_matrix, kron
from scipy.sparse.linalg import LinearOperator, cg, splu
from skfem import Basis, BilinearForm, ElementQuad0, ElementQuad2, ElementVector, MeshQuad, asm
from skfem.helpers import ddot, grad, sym_grad, trace

from sensor.arrays import Flags, Floats, Ints

Line = tuple[Any, Any, Any]  # sparse matrices of elements along a line: mass, stiffness, and derivative times value

BEYOND = 1.4  # ratio of neighbouring element sizes away from the contact, in bodies of revolution
FAST = 1.8  # the same ratio in three dimensions
ON = 1e-9  # tolerance of coordinates [mm]
MOST_SETS = 60  # most active sets that are tried


def lines(edge: float, end: float, cells: int, growth: float, beyond: float = BEYOND) -> Floats:
    """Return coordinates of mesh lines from 0 to `end`, finest on both sides of `edge`, with `cells` cells before it.

    Sizes grow by the factor `growth` per cell from the edge to 0, and by `beyond` outside.
    """
    steps = growth ** np.arange(cells)
    steps *= edge / steps.sum()
    outside = [steps[0]]
    while sum(outside) < end - edge:
        outside.append(outside[-1] * beyond)
    rest = np.cumsum(outside) * (end - edge) / sum(outside)
    return np.concatenate([[0.0], np.cumsum(steps[::-1]), edge + rest])


def depths(skin: float, end: float, cells: int, beyond: float = BEYOND) -> Floats:
    """Return depths of mesh lines from the surface to `end`, with `cells` equal cells in the skin."""
    under = lines(skin / cells, end - skin, 1, 1.0, beyond)[1:] + skin
    return np.concatenate([[0.0], np.cumsum(np.full(cells, skin / cells)), under])


def lame(w: Any) -> tuple[float, float]:
    """Return the Lame parameters lambda and mu for the Poisson's ratio of a form, with E = 1."""
    return w["poisson"] / ((1.0 + w["poisson"]) * (1.0 - 2.0 * w["poisson"])), 0.5 / (1.0 + w["poisson"])


@BilinearForm
def of_revolution(u: Any, v: Any, w: Any) -> Floats:
    """Return the bilinear form of elasticity for a body of revolution, per area of its meridian."""
    lam, mu = lame(w)
    hoop_u = u[0] / w.x[0]
    hoop_v = v[0] / w.x[0]
    strain = ddot(sym_grad(u), sym_grad(v)) + hoop_u * hoop_v
    swelling = (trace(grad(u)) + hoop_u) * (trace(grad(v)) + hoop_v)
    return 2.0 * np.pi * w.x[0] * w["modulus"] * (2.0 * mu * strain + lam * swelling)


def of_line(lines: Floats, modulus: float | Floats = 1.0) -> Line:
    """Return the matrices of quadratic elements along a line, each element multiplied by its relative modulus.

    They are int N_i N_j (mass), int N_i' N_j' (stiffness) and int N_i' N_j (slopes).
    """
    step = np.diff(lines)
    first = 2 * np.arange(len(step))
    nodes = first[:, None] + np.arange(3)
    rows = np.repeat(nodes, 3, axis=1).ravel()
    columns = np.tile(nodes, (1, 3)).ravel()

    def assembled(weight: Floats, element: Any) -> Any:
        values = (modulus * weight)[:, None, None] * np.array(element)
        return csr_matrix((values.ravel(), (rows, columns)))

    masses = assembled(step / 30.0, [[4, 2, -1], [2, 16, 2], [-1, 2, 4]])
    stiffness = assembled(1.0 / (3.0 * step), [[7, -8, 1], [-8, 16, -8], [1, -8, 7]])
    slopes = assembled(np.full(len(step), 1.0 / 6.0), [[-3, -4, 1], [4, 0, -4], [-1, 4, 3]])
    return masses, stiffness, slopes


def of_box(x: Line, y: Line, z: Line, poisson: float) -> Any:
    """Return the stiffness matrix of bricks over three lines; its dofs are all displacements along x, then y, then z.

    Quadratic bricks are tensor products of lines, and so are all integrals over them, even if the modulus changes along
    z. The block of directions i and j is lambda d_i d_j + mu d_j d_i; on the diagonal, mu d_k d_k is added for all k.
    """
    lam = poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson))
    mu = 0.5 / (1.0 + poisson)
    parts = [x, y, z]
    blocks = [[None] * 3 for _ in range(3)]
    for i, j in itertools.product(range(3), range(3)):
        if i == j:
            # The stiffness of each axis, times the masses of the other two.
            terms = []
            for k in range(3):
                factor = lam + 2.0 * mu if k == i else mu
                terms.append((factor, [parts[axis][1 if axis == k else 0] for axis in range(3)]))
        else:
            # The mass of the third axis, times the slopes along i and j.
            terms = [(lam, [parts[axis][0] for axis in range(3)]), (mu, [parts[axis][0] for axis in range(3)])]
            terms[0][1][i], terms[0][1][j] = parts[i][2], parts[j][2].T
            terms[1][1][i], terms[1][1][j] = parts[i][2].T, parts[j][2]
        blocks[i][j] = sum(factor * kron(kron(a, b), c) for factor, (a, b, c) in terms)
    return bmat(blocks, format="csc")


class ByLines:
    """A preconditioner for bricks: the exact inverse of the stiffness without the coupling between directions.

    Without coupling the stiffness is a sum of tensor products, which the eigenmodes of the three lines diagonalise.
    """

    def __init__(self, x: Line, y: Line, z: Line, poisson: float) -> None:
        """Find the eigenmodes of each line for each direction of displacement, and the stiffness of their products."""
        self.shape = tuple(line[0].shape[0] for line in (x, y, z))
        stretched = 2.0 * (1.0 - poisson) / (1.0 - 2.0 * poisson)  # lam + 2 mu over mu
        shear = 0.5 / (1.0 + poisson)
        self.parts = []
        for direction in range(3):
            modes = []
            stiffness = np.zeros((1, 1, 1))
            for axis, (masses, rates, _) in enumerate((x, y, z)):
                # Free nodes: symmetry fixes the first one against motion across its plane, the base fixes the last one.
                kept = slice(1 if axis == direction < 2 else 0, -1 if axis == 2 else None)
                values, vectors = eigh(rates.toarray()[kept, kept], masses.toarray()[kept, kept])
                modes.append((kept, vectors))
                own = shear * (stretched if axis == direction else 1.0) * values
                stiffness = stiffness + own.reshape([-1 if i == axis else 1 for i in range(3)])
            self.parts.append((modes, stiffness))

    def __call__(self, forces: Floats) -> Floats:
        """Return displacements under forces, both for all dofs; held dofs get 0."""
        moved = np.zeros((3, *self.shape))
        for (modes, stiffness), force, of_one in zip(self.parts, forces.reshape(moved.shape), moved, strict=True):
            (i, X), (j, Y), (k, Z) = modes
            of_modes = np.einsum("xyz,xa,yb,zc->abc", force[i, j, k], X, Y, Z, optimize=True) / stiffness
            of_one[i, j, k] = np.einsum("abc,xa,yb,zc->xyz", of_modes, X, Y, Z, optimize=True)
        return moved.ravel()


@dataclass(frozen=True, kw_only=True)
class SkinnedBlock:
    """A square block with a skin on a clamped base, under a cube with this side in its centre [mm].

    `skin` is the thickness of the skin.
    """

    side: float
    width: float
    height: float
    skin: float
    poisson: float = 0.3


def cube_stiffness(block: SkinnedBlock, ratio: float, cells: int) -> float:
    """Return the stiffness of a block under its cube, over the modulus of the flesh [mm].

    `ratio` is the modulus of the skin over the modulus of the flesh, and `cells` the number of elements in half a side
    of the cube. A quarter of the block is solved by conjugate gradients.
    """
    across = lines(0.5 * block.side, 0.5 * block.width, cells, 1.3, FAST)
    down = depths(block.skin, block.height, max(2, cells // 2), FAST)
    in_skin = 0.5 * (down[1:] + down[:-1]) < block.skin
    nodes = [np.sort(np.concatenate([line, 0.5 * (line[1:] + line[:-1])])) for line in (across, across, down)]
    x, y, z = (axis.ravel() for axis in np.meshgrid(*nodes, indexing="ij"))
    base = z > block.height - ON
    under = (z < ON) & (x < 0.5 * block.side + ON) & (y < 0.5 * block.side + ON)
    free = np.flatnonzero(~np.concatenate([(x < ON) | base, (y < ON) | base, under | base]))
    u = np.concatenate([np.zeros(2 * len(x)), under])

    flat = of_line(across)
    layered = of_line(down, np.where(in_skin, ratio, 1.0))
    K = of_box(flat, flat, layered, block.poisson)
    by_lines = ByLines(flat, flat, layered, block.poisson)

    def near(forces: Floats) -> Floats:
        """Return the preconditioned forces: displacements of the free dofs without coupling between directions."""
        whole = np.zeros(len(u))
        whole[free] = forces
        return by_lines(whole)[free]

    u[free], failed = cg(
        K[free][:, free],
        -(K @ u)[free],
        rtol=1e-7,
        maxiter=2000,
        M=LinearOperator((len(free), len(free)), near),
    )
    assert not failed
    return 4.0 * float((K @ u)[2 * len(x) :][under].sum())


@dataclass(frozen=True)
class RoundSolid:
    """A cylinder with a skin, or a piece of a ball with the radius `ball`, under a contact of radius `edge` [mm].

    `skin` is its thickness, `radius` and `height` are of the cylinder, and `cells` is the number of elements in `edge`.
    """

    edge: float
    skin: float
    ball: float | None = None
    radius: float = 14.0
    height: float = 12.0
    poisson: float = 0.3
    cells: int = 12

    def surface_compliance(self, ratio: float) -> tuple[Floats, Floats]:
        """Return the radii (n,) of the surface nodes within 1.6 edges, and the compliance between them (n, n).

        `ratio` is the modulus of the skin over the modulus of the flesh.
        """
        flat = MeshQuad.init_tensor(
            lines(self.edge, self.radius, self.cells, 1.25), depths(self.skin, self.height, self.cells // 2)
        )
        s, down = flat.p
        mesh = MeshQuad(self._bent(s, down), flat.t)
        basis = Basis(mesh, ElementVector(ElementQuad2()), intorder=5)
        in_skin = down[flat.t].mean(axis=0) < self.skin
        modulus = basis.with_element(ElementQuad0()).interpolate(np.where(in_skin, ratio, 1.0))
        K = asm(of_revolution, basis, modulus=modulus, poisson=self.poisson)

        def dofs_on(nodes: Flags) -> Ints:
            """Return the radial and axial dofs of nodes and of the edges between them, (2, n)."""
            edges = np.flatnonzero(np.isin(mesh.facets, np.flatnonzero(nodes)).all(axis=0))
            return np.concatenate([basis.nodal_dofs[:, nodes], basis.facet_dofs[:, edges]], axis=1)

        held = np.union1d(dofs_on(s == 0.0)[0], dofs_on(down == down.max()))
        top = dofs_on(down == 0.0)
        r = basis.doflocs[0, top[0]]
        top = top[:, np.argsort(r)]
        r = np.sort(r)
        near = r < 1.6 * self.edge
        free = np.setdiff1d(np.arange(basis.N), held)
        lu = splu(K[free][:, free].tocsc())
        loads = np.zeros((basis.N, int(near.sum())))
        loads[top[1, near], np.arange(loads.shape[1])] = 1.0
        sunk = np.zeros_like(loads)
        sunk[free] = lu.solve(loads[free])
        return r[near], sunk[top[1, near]]

    def _bent(self, s: Floats, down: Floats) -> Floats:
        """Return r and z (2, n) [mm] for nodes at the radius `s` and the depth `down` in the cylinder.

        In a piece of a ball the skin has constant thickness along the normal, and the base is flat.
        """
        if self.ball is None:
            return np.stack([s, -down])
        cosine = np.sqrt(1.0 - (s / self.ball) ** 2)
        top = np.stack([s, self.ball * (cosine - 1.0)])
        under_skin = top - self.skin * np.stack([s / self.ball, cosine])
        base = np.stack([s, np.full(len(s), -self.height)])
        deep = np.maximum(down - self.skin, 0.0) / (self.height - self.skin)
        return top + np.minimum(down / self.skin, 1.0) * (under_skin - top) + deep * (base - under_skin)

    def flat(self, ratio: float) -> float:
        """Return the stiffness under a flat round tip of radius `edge`, over the modulus of the flesh [mm]."""
        r, sinking = self.surface_compliance(ratio)
        under = r < self.edge + ON
        return float(np.linalg.solve(sinking[under][:, under], np.ones(under.sum())).sum())

    def dome(self, ratio: float, curvature: float, depth: float) -> float:
        """Return the force on a paraboloid over the modulus of the flesh [mm^2], by an active set of touching nodes.

        `curvature` [1/mm] is relative to the surface, and `depth` [mm] is the indentation.
        """
        r, sinking = self.surface_compliance(ratio)
        gap = depth - 0.5 * curvature * r**2
        on = gap > 0.0
        for _ in range(MOST_SETS):
            force = np.zeros(len(r))
            force[on] = np.linalg.solve(sinking[on][:, on], gap[on])
            entered = gap - sinking @ force > 1e-12
            now = (on & (force > 0.0)) | (~on & entered)
            if (now == on).all():
                return float(force.sum())
            on = now
        raise AssertionError("the contact does not settle")
