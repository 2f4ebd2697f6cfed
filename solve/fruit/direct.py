"""Two rigid, flat, frictionless tips pressed on the fruit, solved directly by finite elements.

Under a tip u_z is prescribed and the tangential displacement free; the base is clamped.
"""

import time
from collections.abc import Mapping, Sequence

import numpy as np
from scipy.sparse import csc_matrix
from skfem import CellBasis, ElementTetP2, Mesh

from cad.design.fruit import Fruit
from cad.design.tips import Tips
from solve.arrays import Floats, Ints
from solve.elasticity import stiffness_matrix, vector_basis
from solve.error_estimate import Extrapolated, SolveInfo, richardson
from solve.fruit.compliance import TIPS, FruitCompliance, MeshCompliance
from solve.linear import SolveError, check_cost, factorised

Held = Mapping[str, Sequence[int]]

EDGE_RATE = 1.0  # u ~ r^1/2 at the edge of a sharp tip: strain energy converges at first order in the size there
BALANCE_LIMIT = 1e-8
SHAPE_LIMIT = 1e-6
VERTICAL = 3  # components count from 1, as the names u^1, u^2, u^3 of scikit-fem do
# Quadratic tetrahedra stiffen as nu tends to 0.5: what three meshes leave of that, found against the split
# by tests/fits/locking.py.
LOCKS_TO = 0.4999
LOCKING = (4e-4, 3.2e-3, 0.4)  # at nu 0.45, growth from there, power of 1 - 2 nu
WIDEST_ERROR = 0.1  # relative: an answer known no better than this tells nothing of ripeness
MIDDLE, SIDE = "symmetry_x", "symmetry_y"  # planes through the middle of the fruit, and along both tips
FACES = tuple(f"{name}_tip" for name in TIPS)
OTHERS = ~np.eye(len(TIPS), dtype=bool)
METHOD = "direct finite elements, quadratic tetrahedra, extrapolated"


def direct_compliance(meshes: Sequence[Mesh], fruit: Fruit, tips: Tips) -> FruitCompliance:
    """Return the compliance [1/mm] extrapolated from three graded meshes [mm] of one family, coarse to fine.

    The meshes are of the quarter x, y >= 0 (tips central), of the half y >= 0 or of the whole block, told by their
    boundaries. Raises SolveError before it starts when a mesh is not of this fruit and these tips or the finest would
    take too much memory, later when a solve, the balance of reactions or the reciprocity of the loads fails, or when
    the error exceeds 10 %.
    """
    start = time.perf_counter()
    locked = locking(fruit.poisson)
    _check_meshes(meshes, fruit, tips)
    solved = [mesh_compliance(mesh, fruit.poisson) for mesh in meshes]
    own = _limits(solved, [outline_size(mesh) for mesh in meshes])
    worst = max(own, key=lambda limit: limit.error)
    S, drift = _with_crosstalk([limit.value for limit in own], solved[-2].S, solved[-1].S)
    error = (worst.error + drift) / float(np.diag(S).mean() - S[OTHERS].mean()) + locked
    _check_error(error)
    seconds = time.perf_counter() - start
    info = SolveInfo(method=METHOD, dofs=solved[-1].dofs, seconds=seconds, status=worst.status)
    return FruitCompliance(S=S, error_pair=error, error_own=own[0].error / own[0].value + locked, info=info)


def _limits(solved: Sequence[MeshCompliance], sizes: Sequence[float]) -> list[Extrapolated]:
    """Return the limit of each tip's own compliance [1/mm]."""
    diagonals = np.array([np.diag(one.S) for one in solved])
    return [richardson(values, sizes, EDGE_RATE) for values in diagonals.T.tolist()]


def _check_error(error: float) -> None:
    if not error <= WIDEST_ERROR:
        remedy = "take a fruit that is thicker, or tips farther from its edges"
        msg = f"contact: relative error of s11 - s12 = {error:.2g}: must be at most {WIDEST_ERROR:g}; {remedy}"
        raise SolveError(msg)


def _with_crosstalk(own: Sequence[float], coarse: Floats, fine: Floats) -> tuple[Floats, float]:
    """Return the compliance with the limits of its diagonal, and how far its crosstalk drifts between two meshes.

    Crosstalk hardly sees the edges: it is the finest mesh's, which extrapolation would only make noisier.
    """
    S, coarser = (0.5 * (one + one.T) for one in (fine, coarse))
    drift = float(np.abs(S - coarser)[OTHERS].max())
    np.fill_diagonal(S, own)
    return S, drift


def locking(poisson: float) -> float:
    """Return the relative error [1] that locking may leave; raises SolveError where it is out of bounds."""
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
    boundaries = mesh.boundaries or {}
    held: Held = {"base": (1, 2, 3)}
    share = 1.0
    if SIDE in boundaries:
        held, share = {**held, SIDE: (2,)}, 0.5
    if MIDDLE not in boundaries:
        return MeshCompliance(
            share * np.asarray(np.linalg.inv(tip_stiffness(basis, K, held, FACES)), dtype=np.float64), int(basis.N)
        )
    # what x = 0 holds when both tips press alike, and against each other
    alike, against = (tip_stiffness(basis, K, {**held, MIDDLE: fixed}, FACES[1:])[0, 0] for fixed in ((1,), (2, 3)))
    even, odd = 0.5 * share / alike * np.ones(2), 0.5 * share / against * np.array([1.0, -1.0])
    return MeshCompliance(np.array([even + odd, even - odd]), int(basis.N))


def tip_stiffness(basis: CellBasis, K: csc_matrix, held: Held, faces: Sequence[str]) -> Floats:
    """Return the reaction on face i to a unit press of face j with the others held, E K_ij, shape (faces, faces).

    `held` names the displacement components fixed at zero on each boundary. One factorisation serves all presses.
    Raises SolveError when reactions do not balance or the loads are not reciprocal.
    """
    supports = [name for name, components in held.items() if VERTICAL in components]
    if not supports:
        msg = f"contact: supports {', '.join(held) or 'none'}: one must hold u_z; clamp the base"
        raise SolveError(msg)
    under = _vertical(basis, faces)
    factor = factorised(K, np.concatenate([*(_dofs(basis, *clamp) for clamp in held.items()), *under]))
    press = np.array([np.isin(factor.fixed, dofs) for dofs in under], dtype=np.float64).T
    reactions = K @ factor.solve(np.zeros((basis.N, len(faces))), press)
    stiffness = np.array([reactions[dofs].sum(axis=0) for dofs in under])
    beside = np.setdiff1d(np.concatenate(_vertical(basis, supports)), np.concatenate(under))
    check_balance(stiffness, reactions[beside].sum(axis=0))
    return stiffness


def check_balance(stiffness: Floats, support: Floats) -> None:
    """Raise SolveError unless the faces' reactions (faces, faces) balance the supports' (faces,), and are reciprocal.

    Reciprocity is Betti's theorem: the force on one face from a press of another is the same when they change places.
    """
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


def _check_meshes(meshes: Sequence[Mesh], fruit: Fruit, tips: Tips) -> None:
    """Raise SolveError unless all are of this fruit and these tips, and the unknowns of the last fit in memory."""
    for mesh in meshes:
        check_mesh(mesh, fruit, tips)
    corners, edges = (places.shape[1] for places in (meshes[-1].p, meshes[-1].edges))
    check_cost(3 * (corners + edges))


def check_mesh(mesh: Mesh, fruit: Fruit, tips: Tips) -> None:
    """Raise SolveError unless the mesh [mm] has the extent of the fruit and the footprints of the tips."""
    boundaries = mesh.boundaries or {}
    along, across = (0.5 if plane in boundaries else 1.0 for plane in (MIDDLE, SIDE))
    extent = along * fruit.length_mm, across * fruit.width_mm, fruit.height_mm
    for what, size, wanted in zip(("length", "width", "height"), np.ptp(mesh.p, axis=1), extent, strict=True):
        _check_size(what, size, wanted, fruit)
    for name, centre in zip(FACES, tips.centres_mm, strict=True):
        if name in boundaries:
            x, y, _ = mesh.p[:, np.unique(mesh.facets[:, boundaries[name]])]
            _check_size(f"{name} length", np.ptp(x), tips.side_mm, fruit)
            _check_size(f"{name} width", np.ptp(y), across * tips.side_mm, fruit)
            _check_size(f"{name} centre", 0.5 * (x.min() + x.max()), centre, fruit)


def _check_size(what: str, size: float, wanted: float, fruit: Fruit) -> None:
    if not abs(size - wanted) <= SHAPE_LIMIT * fruit.length_mm:
        msg = f"contact: {what} of the mesh = {size:g} mm: must be {wanted:g} mm; mesh this fruit and these tips"
        raise SolveError(msg)


def outline_size(mesh: Mesh) -> float:
    """Return the mean length [mm] of the mesh edges along the outline of the tips' footprints."""
    boundaries = mesh.boundaries or {}
    tips, cuts = (
        [mesh.f2e[:, boundaries[name]].ravel() for name in names if name in boundaries]
        for names in (FACES, (MIDDLE, SIDE))
    )
    if not tips:
        raise SolveError(_unknown(FACES[-1], mesh))
    edges, count = np.unique(np.concatenate(tips), return_counts=True)
    outline = np.setdiff1d(edges[count == 1], np.concatenate(cuts) if cuts else [])
    start, end = mesh.p[:, mesh.edges[:, outline]].transpose(1, 0, 2)
    return float(np.linalg.norm(end - start, axis=0).mean())


def _vertical(basis: CellBasis, names: Sequence[str]) -> list[Ints]:
    return [_dofs(basis, name, (VERTICAL,)) for name in names]


def _dofs(basis: CellBasis, name: str, components: Sequence[int]) -> Ints:
    if name not in (basis.mesh.boundaries or {}):
        raise SolveError(_unknown(name, basis.mesh))
    return np.asarray(basis.get_dofs(name).all([f"u^{component}" for component in components]))


def _unknown(name: str, mesh: Mesh) -> str:
    known = ", ".join(mesh.boundaries or {}) or "none"
    return f"contact: boundary {name!r} is unknown on the mesh; known boundaries: {known}"
