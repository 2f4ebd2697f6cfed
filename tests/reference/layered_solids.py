"""A skinned body of revolution under a round tip in its middle, and a skinned block under a cube, as solids.

Nothing of a layered half-space is in them: the skin is elements of another modulus. Quadratic elements, graded to the
edge of the contact; the tip is rigid and frictionless, the base held, lengths in mm, the modulus of the flesh 1.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse.linalg import splu
from skfem import (
    Basis,
    BilinearForm,
    ElementHex0,
    ElementHex2,
    ElementQuad0,
    ElementQuad2,
    ElementVector,
    MeshHex,
    MeshQuad,
    asm,
)
from skfem.helpers import ddot, div, grad, sym_grad, trace

BEYOND = 1.4  # each step over the one before, away from the contact
FAST = 1.8  # the same in three dimensions
ON = 1e-9


def lines(edge, end, cells, growth, beyond=BEYOND):
    """Return lines from 0 to an end, finest on both sides of an edge, so many before it."""
    steps = growth ** np.arange(cells)
    steps *= edge / steps.sum()
    outside = [steps[0]]
    while sum(outside) < end - edge:
        outside.append(outside[-1] * beyond)
    rest = np.cumsum(outside) * (end - edge) / sum(outside)
    return np.concatenate([[0.0], np.cumsum(steps[::-1]), edge + rest])


def depths(skin, end, cells, beyond=BEYOND):
    """Return lines down from the surface, so many equal cells in the skin."""
    under = lines(skin / cells, end - skin, 1, 1.0, beyond)[1:] + skin
    return np.concatenate([[0.0], np.cumsum(np.full(cells, skin / cells)), under])


def lame(w):
    return w["poisson"] / ((1.0 + w["poisson"]) * (1.0 - 2.0 * w["poisson"])), 0.5 / (1.0 + w["poisson"])


@BilinearForm
def of_revolution(u, v, w):
    lam, mu = lame(w)
    hoop_u = u[0] / w.x[0]
    hoop_v = v[0] / w.x[0]
    strain = ddot(sym_grad(u), sym_grad(v)) + hoop_u * hoop_v
    swelling = (trace(grad(u)) + hoop_u) * (trace(grad(v)) + hoop_v)
    return 2.0 * np.pi * w.x[0] * w["modulus"] * (2.0 * mu * strain + lam * swelling)


@BilinearForm
def of_solid(u, v, w):
    lam, mu = lame(w)
    return w["modulus"] * (2.0 * mu * ddot(sym_grad(u), sym_grad(v)) + lam * div(u) * div(v))


def cube_stiffness(cells, ratio, side, width, height, skin, poisson=0.3):
    """Return the stiffness of a block's middle under a cube, so many cells in half its side: a quarter of the block."""
    across = lines(0.5 * side, 0.5 * width, cells, 1.3, FAST)
    mesh = MeshHex.init_tensor(across, across, depths(skin, height, max(2, cells // 2), FAST))
    basis = Basis(mesh, ElementVector(ElementHex2()), intorder=4)
    component = np.empty(basis.N, dtype=int)
    dofs = basis.dofs
    for of_kind in (dofs.nodal_dofs, dofs.edge_dofs, dofs.facet_dofs, dofs.interior_dofs):
        component[of_kind] = np.arange(len(of_kind))[:, None] % 3
    x, y, down = basis.doflocs
    held = ((x < ON) & (component == 0)) | ((y < ON) & (component == 1)) | (down > height - ON)
    under = (down < ON) & (x < 0.5 * side + ON) & (y < 0.5 * side + ON) & (component == 2)
    in_skin = mesh.p[2][mesh.t].mean(axis=0) < skin
    modulus = basis.with_element(ElementHex0()).interpolate(np.where(in_skin, ratio, 1.0))
    K = asm(of_solid, basis, modulus=modulus, poisson=poisson).tocsc()
    free = np.flatnonzero(~held & ~under)
    u = under.astype(float)
    factor = splu(K[free][:, free], permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    u[free] = -factor.solve(K[free] @ u)
    return 4.0 * float((K @ u)[under].sum())


@dataclass(frozen=True)
class RoundSolid:
    """A cylinder, or a piece of a ball, of a radius and height under a contact of radius `edge`; its skin."""

    edge: float
    skin: float
    ball: float | None = None
    radius: float = 14.0
    height: float = 12.0
    poisson: float = 0.3
    cells: int = 12

    def surface_compliance(self, ratio):
        """Return radii of the nodes within 1.6 edges and the sinking of each under forces on each, (n, n)."""
        flat = MeshQuad.init_tensor(
            lines(self.edge, self.radius, self.cells, 1.25), depths(self.skin, self.height, self.cells // 2)
        )
        s, down = flat.p
        places = np.stack([s, -down])
        if self.ball is not None:
            cosine = np.sqrt(1.0 - (s / self.ball) ** 2)
            top = np.stack([s, self.ball * (cosine - 1.0)])
            under_skin = top - self.skin * np.stack([s / self.ball, cosine])
            base = np.stack([s, np.full(len(s), -self.height)])
            deep = np.maximum(down - self.skin, 0.0) / (self.height - self.skin)
            places = top + np.minimum(down / self.skin, 1.0) * (under_skin - top) + deep * (base - under_skin)
        mesh = MeshQuad(places, flat.t)
        basis = Basis(mesh, ElementVector(ElementQuad2()), intorder=5)
        in_skin = down[flat.t].mean(axis=0) < self.skin
        modulus = basis.with_element(ElementQuad0()).interpolate(np.where(in_skin, ratio, 1.0))
        K = asm(of_revolution, basis, modulus=modulus, poisson=self.poisson)

        def dofs_on(nodes):
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

    def flat(self, ratio):
        """Return the stiffness under a flat circle of radius `edge`."""
        r, sinking = self.surface_compliance(ratio)
        under = r < self.edge + ON
        return float(np.linalg.solve(sinking[under][:, under], np.ones(under.sum())).sum())

    def dome(self, ratio, curvature, depth):
        """Return the force of a paraboloid of a curvature against the surface at a depth."""
        r, sinking = self.surface_compliance(ratio)
        gap = depth - 0.5 * curvature * r**2
        on = gap > 0.0
        for _ in range(60):
            force = np.zeros(len(r))
            force[on] = np.linalg.solve(sinking[on][:, on], gap[on])
            entered = gap - sinking @ force > 1e-12
            now = (on & (force > 0.0)) | (~on & entered)
            if (now == on).all():
                return float(force.sum())
            on = now
        raise AssertionError("the contact does not settle")
