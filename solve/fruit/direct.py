"""Two rigid, flat, frictionless tips pressed on the fruit, solved directly by finite elements.

Under a tip u_z is prescribed and the tangential displacement free; the base is clamped. Index 1 is the low tip.
"""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix
from skfem import CellBasis, ElementTetP2, Mesh

from cad.design.parameters import Fruit, Tips
from solve.elasticity import stiffness_matrix, vector_basis
from solve.error_estimate import richardson
from solve.fruit.compliance import Compliance
from solve.linear import SolveError, factorised

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Held = Mapping[str, Sequence[int]]

EDGE_RATE = 1.0  # u ~ r^1/2 at the edge of a sharp tip: strain energy converges at first order in the size there
BALANCE_LIMIT = 1e-8
SHAPE_LIMIT = 1e-6
VERTICAL = 3  # components count from 1, as the names u^1, u^2, u^3 of scikit-fem do
# Quadratic tetrahedra stiffen as nu tends to 0.5: what three meshes leave of that, found against the split.
LOCKS_TO = 0.4999
LOCKING = (4e-4, 3.2e-3, 0.4)  # at nu 0.45, growth from there, power of 1 - 2 nu
WIDEST_ERROR = 0.1  # relative: an answer known no better than this tells nothing of ripeness
METHOD = "direct finite elements, quadratic tetrahedra, extrapolated"


@dataclass(frozen=True, kw_only=True)
class MeshCompliance:
    """The 2 x 2 compliance times E [1/mm] on one mesh, and its dofs."""

    S: Floats
    dofs: int


def direct_compliance(meshes: Sequence[Mesh], fruit: Fruit, tips: Tips) -> Compliance:
    """Return the compliance extrapolated from three graded meshes [mm] of one family, coarse to fine.

    The meshes are of the quarter x, y >= 0 (tips central), of the half y >= 0 or of the whole block, told by their
    boundaries. Raises SolveError when a mesh is not of this fruit and these tips, when a solve, the balance of
    reactions or the reciprocity of the loads fails, or when the error exceeds 10 %.
    """
    start = time.perf_counter()
    locked = locking(fruit.poisson)
    for mesh in meshes:
        check_mesh(mesh, fruit, tips)
    sizes = [outline_size(mesh) for mesh in meshes]
    found = [mesh_compliance(mesh, fruit.poisson) for mesh in meshes]
    low, high = (richardson([float(one.S[i, i]) for one in found], sizes, EDGE_RATE) for i in (0, 1))
    # Crosstalk hardly sees the edges: it is the finest mesh's, which extrapolation would only make noisier.
    crosstalk = [float(one.S[0, 1] + one.S[1, 0]) / 2.0 for one in found]
    worse = max((low, high), key=lambda one: one.error)
    drift = abs(crosstalk[-1] - crosstalk[-2])
    S = ((low.value, crosstalk[-1]), (crosstalk[-1], high.value))
    error = (worse.error + drift) / (0.5 * (low.value + high.value) - crosstalk[-1]) + locked
    if not error <= WIDEST_ERROR:
        remedy = "take a fruit that is thicker, or tips farther from its edges"
        msg = f"contact: relative error of s11 - s12 = {error:.2g}: must be at most {WIDEST_ERROR:g}; {remedy}"
        raise SolveError(msg)
    return Compliance(
        S=S,
        error_percent=100.0 * error,
        s11_error_percent=100.0 * (low.error / low.value + locked),
        method=METHOD,
        dofs=found[-1].dofs,
        seconds=time.perf_counter() - start,
        status=worse.status,
    )


def locking(poisson: float) -> float:
    """Return the relative error that locking may leave; raises SolveError where it is out of bounds."""
    if poisson > LOCKS_TO:
        msg = f"fruit.poisson = {poisson:.6g}: must be at most {LOCKS_TO:g} for direct elements; they lock beyond"
        raise SolveError(msg)
    start, growth, power = LOCKING
    return max(0.0, start + growth * (float((0.1 / (1.0 - 2.0 * poisson)) ** power) - 1.0))


def mesh_compliance(mesh: Mesh, poisson: float) -> MeshCompliance:
    """Return the compliance on one mesh [mm] of a quarter, a half or the whole block; each mode's is at most the true.

    Prescribed displacement overestimates the stiffness of each mode. Raises SolveError as `direct_compliance` does.
    """
    basis = vector_basis(mesh, ElementTetP2(), order=2)
    K = stiffness_matrix(basis, 1.0, poisson)
    held: Held = {"base": (1, 2, 3)}
    share = 1.0
    if "symmetry_y" in (mesh.boundaries or {}):
        held, share = {**held, "symmetry_y": (2,)}, 0.5
    if "symmetry_x" not in (mesh.boundaries or {}):
        stiffness = tip_stiffness(basis, K, held, ("low_tip", "high_tip")) / share
        return MeshCompliance(S=np.linalg.inv(stiffness).astype(np.float64), dofs=int(basis.N))
    modes: tuple[tuple[int, ...], ...] = ((1,), (2, 3))  # x = 0 when both tips press alike, and against each other
    alike, against = (
        share / float(tip_stiffness(basis, K, {**held, "symmetry_x": fixed}, ("high_tip",))[0, 0]) for fixed in modes
    )
    own, cross = 0.5 * (alike + against), 0.5 * (alike - against)
    return MeshCompliance(S=np.array([[own, cross], [cross, own]]), dofs=int(basis.N))


def tip_stiffness(basis: CellBasis, K: csc_matrix, held: Held, tips: Sequence[str]) -> Floats:
    """Return the reaction on tip i to a unit press of tip j with the others held, shape (tips, tips).

    `held` names the displacement components fixed at zero on each boundary. One factorisation serves all presses.
    Raises SolveError when reactions do not balance or the loads are not reciprocal.
    """
    clamp = np.concatenate([_dofs(basis, name, components) for name, components in held.items()])
    under = [_dofs(basis, name, (VERTICAL,)) for name in tips]
    factor = factorised(K, np.concatenate([clamp, *under]))
    press = np.zeros((K.shape[0], len(tips)))
    for j, dofs in enumerate(under):
        press[dofs, j] = 1.0
    u = factor.solve(np.zeros_like(press), press[factor.fixed])
    reactions = K @ u
    stiffness = np.array([reactions[dofs].sum(axis=0) for dofs in under])
    support = [_dofs(basis, name, (VERTICAL,)) for name, components in held.items() if VERTICAL in components]
    if not support:
        msg = f"contact: supports {', '.join(held) or 'none'}: one must hold u_z; clamp the base"
        raise SolveError(msg)
    check_balance(stiffness, reactions[np.setdiff1d(np.concatenate(support), np.concatenate(under))].sum(axis=0))
    return stiffness


def check_balance(stiffness: Floats, support: Floats) -> None:
    """Raise SolveError unless the tips' reactions balance the supports' for each press, and are reciprocal (Betti)."""
    scale = float(np.abs(stiffness).max())
    rest = float(np.abs(stiffness.sum(axis=0) + support).max())
    if not rest <= BALANCE_LIMIT * scale:
        msg = (
            f"contact: reactions of tips and supports add up to {rest / scale:.1e} of the largest: must be at most "
            f"{BALANCE_LIMIT:.0e}; check that every support is named"
        )
        raise SolveError(msg)
    skew = float(np.abs(stiffness - stiffness.T).max())
    if not skew <= BALANCE_LIMIT * scale:
        msg = (
            f"contact: force on one tip from the other differs by {skew / scale:.1e} of the largest reaction when they "
            f"change places: must be at most {BALANCE_LIMIT:.0e}; check that the matrix is symmetric"
        )
        raise SolveError(msg)


def check_mesh(mesh: Mesh, fruit: Fruit, tips: Tips) -> None:
    """Raise SolveError unless the mesh [mm] has the extent of the fruit and the footprints of the tips."""
    boundaries = mesh.boundaries or {}
    share = {name: 0.5 if name in boundaries else 1.0 for name in ("symmetry_x", "symmetry_y")}
    expected = {
        "length": (float(np.ptp(mesh.p[0])), share["symmetry_x"] * fruit.length_mm),
        "width": (float(np.ptp(mesh.p[1])), share["symmetry_y"] * fruit.width_mm),
        "height": (float(np.ptp(mesh.p[2])), fruit.height_mm),
    }
    for name, centre in zip(("low_tip", "high_tip"), tips.centres_mm, strict=True):
        if name in boundaries:
            x, y, _ = mesh.p[:, np.unique(mesh.facets[:, boundaries[name]])]
            expected[f"{name} length"] = (float(np.ptp(x)), tips.side_mm)
            expected[f"{name} width"] = (float(np.ptp(y)), share["symmetry_y"] * tips.side_mm)
            expected[f"{name} centre"] = (float(0.5 * (x.min() + x.max())), centre)
    for what, (found, value) in expected.items():
        if not abs(found - value) <= SHAPE_LIMIT * fruit.length_mm:
            msg = f"contact: {what} of the mesh = {found:g} mm: must be {value:g} mm; mesh this fruit and these tips"
            raise SolveError(msg)


def outline_size(mesh: Mesh) -> float:
    """Return the mean length [mm] of the mesh edges along the outline of the tips' footprints."""
    boundaries = mesh.boundaries or {}
    tips = [mesh.f2e[:, boundaries[name]].ravel() for name in ("low_tip", "high_tip") if name in boundaries]
    cuts = [mesh.f2e[:, boundaries[name]].ravel() for name in ("symmetry_x", "symmetry_y") if name in boundaries]
    if not tips:
        raise SolveError(_unknown("high_tip", mesh))
    edges, count = np.unique(np.concatenate(tips), return_counts=True)
    outline = np.setdiff1d(edges[count == 1], np.concatenate(cuts) if cuts else [])
    start, end = mesh.p[:, mesh.edges[:, outline]].transpose(1, 0, 2)
    return float(np.linalg.norm(end - start, axis=0).mean())


def _dofs(basis: CellBasis, name: str, components: Sequence[int]) -> Ints:
    if name not in (basis.mesh.boundaries or {}):
        raise SolveError(_unknown(name, basis.mesh))
    found = basis.get_dofs(name)
    return np.concatenate([found.all(f"u^{component}") for component in components])


def _unknown(name: str, mesh: Mesh) -> str:
    known = ", ".join(mesh.boundaries or {}) or "none"
    return f"contact: boundary {name!r} is unknown on the mesh; known boundaries: {known}"
