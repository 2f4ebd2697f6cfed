"""Two rigid, flat, frictionless tips pressed on the fruit, solved directly by finite elements.

Under a tip, u_z is prescribed and the tangential displacement is free. The base is clamped.
"""

import time
from collections.abc import Mapping, Sequence

import numpy as np
from scipy.sparse import csc_matrix
from skfem import CellBasis, ElementTetP2, Mesh

from reference.extrapolation import richardson
from sensor.arrays import Floats
from solve.elasticity import stiffness_matrix, vector_basis
from solve.error_estimate import SolveInfo
from solve.fruit.compliance import TIPS, FruitCompliance, MeshCompliance
from solve.linear import SolveError, check_cost, factorise

Held = Mapping[str, Sequence[str]]  # components of the displacement that are fixed at 0, by boundary

EDGE_RATE = 1.0  # u ~ r^1/2 at the edge of a sharp tip, so the energy converges at first order in the size there
BALANCE_LIMIT = 1e-8  # largest unbalanced reaction over the largest reaction
# Quadratic tetrahedra lock as nu tends to 0.5. These are the largest nu, and the relative error that remains after
# extrapolation from three meshes, fitted to the split solution. The table of bars has cases at nu = 0.4999.
LOCKS_TO = 0.4999
LOCKING = (4e-4, 3.2e-3, 0.4)  # error at nu = 0.45, factor of its growth, power of 1 / (1 - 2 nu)
WIDEST_ERROR = 0.1  # largest relative error of a compliance that still distinguishes ripeness
MIDDLE = "symmetry_x"  # plane of symmetry between the tips
SIDE = "symmetry_y"  # plane of symmetry through both tips
FACES = tuple(f"{name}_tip" for name in TIPS)
METHOD = "direct finite elements, quadratic tetrahedra, extrapolated"


def direct_compliance(meshes: Sequence[Mesh], poisson: float) -> FruitCompliance:
    """Return the compliance [1/mm] extrapolated from three graded meshes [mm] of one family, coarse to fine.

    The meshes are of the quarter x, y >= 0 (central tips), of the half y >= 0, or of the whole block; their boundaries
    show which. Raises SolveError if the finest mesh would need too much memory, if a solve, the balance of reactions or
    the reciprocity of loads fails, or if the relative error exceeds 10 %.
    """
    start = time.perf_counter()
    locking_share = locking_error(poisson)
    finest = meshes[-1]
    check_cost(3 * (finest.p.shape[1] + finest.edges.shape[1]))
    solved = [mesh_compliance(mesh, poisson) for mesh in meshes]

    # The compliance of each tip under its own force is extrapolated to zero element size at its edge.
    sizes = [outline_size(mesh) for mesh in meshes]
    diagonals = np.array([np.diag(each.S) for each in solved])
    limits = [richardson(values, sizes, EDGE_RATE) for values in diagonals.T.tolist()]
    worst = max(limits, key=lambda limit: limit.error)

    # The crosstalk depends very little on the element size at the edges of the tips. It is taken from the finest mesh,
    # because an extrapolation would only add noise.
    off_diagonal = ~np.eye(len(TIPS), dtype=bool)
    coarser = solved[-2].S
    S = 0.5 * (solved[-1].S + solved[-1].S.T)
    crosstalk_change = float(np.abs(S - 0.5 * (coarser + coarser.T))[off_diagonal].max())
    np.fill_diagonal(S, [limit.value for limit in limits])
    error = (worst.error + crosstalk_change) / float(np.diag(S).mean() - S[off_diagonal].mean()) + locking_share
    if not error <= WIDEST_ERROR:
        hint = "take a fruit that is thicker, or tips farther from its edges"
        msg = f"contact: relative error of s11 - s12 = {error:.2g}: must be at most {WIDEST_ERROR:g}; {hint}"
        raise SolveError(msg)
    return FruitCompliance(
        S=S,
        error_pair=error,
        error_own=limits[0].error / limits[0].value + locking_share,
        info=SolveInfo(method=METHOD, dofs=solved[-1].dofs, seconds=time.perf_counter() - start, status=worst.status),
    )


def locking_error(poisson: float) -> float:
    """Return the relative error due to locking [1]; raises SolveError for a Poisson's ratio above `LOCKS_TO`."""
    if poisson > LOCKS_TO:
        msg = f"fruit.poisson = {poisson:.6g}: must be at most {LOCKS_TO:g} for direct elements; they lock beyond"
        raise SolveError(msg)
    start, growth, power = LOCKING
    return max(0.0, start + growth * (float((0.1 / (1.0 - 2.0 * poisson)) ** power) - 1.0))


def mesh_compliance(mesh: Mesh, poisson: float) -> MeshCompliance:
    """Return the compliance of the tips for E = 1 [1/mm], on one mesh [mm] of a quarter, a half or the whole block.

    Each eigenvalue of the compliance is at most the true one, because finite elements with prescribed displacements
    overestimate the stiffness. Raises SolveError like `direct_compliance`.
    """
    basis = vector_basis(mesh, ElementTetP2(), order=2)
    K = stiffness_matrix(basis, 1.0, poisson)
    held: Held = {"base": ("u^1", "u^2", "u^3")}
    fraction = 1.0  # share of the force of a tip that the meshed part carries
    if SIDE in mesh.boundaries:
        held = {**held, SIDE: ("u^2",)}
        fraction = 0.5
    if MIDDLE not in mesh.boundaries:
        stiffness = tip_stiffness(basis, K, held, FACES)
        return MeshCompliance(fraction * np.asarray(np.linalg.inv(stiffness), dtype=np.float64), int(basis.N))
    # A quarter has one tip. The conditions on the plane x = 0 decide whether the mirrored tip is pressed equally or
    # oppositely. s11 and s12 of two equal tips are half the sum and half the difference of these two modes.
    equal = tip_stiffness(basis, K, {**held, MIDDLE: ("u^1",)}, FACES[1:])[0, 0]
    opposite = tip_stiffness(basis, K, {**held, MIDDLE: ("u^2", "u^3")}, FACES[1:])[0, 0]
    even = 0.5 * fraction / equal
    odd = 0.5 * fraction / opposite
    return MeshCompliance(np.array([[even + odd, even - odd], [even - odd, even + odd]]), int(basis.N))


def tip_stiffness(basis: CellBasis, K: csc_matrix, held: Held, faces: Sequence[str]) -> Floats:
    """Return the stiffness of the tips over E [mm], (faces, faces), from the stiffness matrix K of the fruit.

    Entry ij is the reaction on face i when face j is pressed in by 1 and the others are held. `held` names the
    displacement components that are fixed at 0 on each boundary. Raises SolveError if reactions do not balance or loads
    are not reciprocal.
    """
    under_tips = [basis.get_dofs(face).all("u^3") for face in faces]
    clamped = [basis.get_dofs(name).all(list(components)) for name, components in held.items()]
    factor = factorise(K, np.concatenate([*clamped, *under_tips]))
    press = np.column_stack([np.isin(factor.fixed, dofs) for dofs in under_tips]).astype(np.float64)
    reactions = K @ factor.solve(np.zeros((basis.N, len(faces))), press)
    stiffness = np.array([reactions[dofs].sum(axis=0) for dofs in under_tips])

    supports = [basis.get_dofs(name).all("u^3") for name, components in held.items() if "u^3" in components]
    beside_tips = np.setdiff1d(np.concatenate(supports), np.concatenate(under_tips))
    check_balance(stiffness, reactions[beside_tips].sum(axis=0))
    return stiffness


def check_balance(stiffness: Floats, support: Floats) -> None:
    """Raise SolveError unless the forces on faces (faces, faces) balance the supports (faces,) and are reciprocal.

    Reciprocity is Betti's theorem: the stiffness is a symmetric matrix.
    """
    scale = float(np.abs(stiffness).max())
    unbalanced = float(np.abs(stiffness.sum(axis=0) + support).max())
    if not unbalanced <= BALANCE_LIMIT * scale:
        msg = (
            f"contact: reactions of tips and supports add up to {unbalanced / scale:.1e} of the largest: must be at "
            f"most {BALANCE_LIMIT:.0e}; check that every support is named"
        )
        raise SolveError(msg)
    skew = float(np.abs(stiffness - stiffness.T).max())
    if not skew <= BALANCE_LIMIT * scale:
        msg = (
            f"contact: the forces of one tip on another and back differ by {skew / scale:.1e} of the largest reaction: "
            f"must be at most {BALANCE_LIMIT:.0e}. Check that the matrix is symmetric."
        )
        raise SolveError(msg)


def outline_size(mesh: Mesh) -> float:
    """Return the mean length of the mesh edges along the outlines of the tips [mm], without planes of symmetry.

    An edge is on the outline if it belongs to only one facet of a tip face.
    """
    tip_facets = [mesh.boundaries[face] for face in FACES if face in mesh.boundaries]
    edges, count = np.unique(mesh.f2e[:, np.concatenate(tip_facets)], return_counts=True)
    outline = edges[count == 1]
    for plane in (MIDDLE, SIDE):
        if plane in mesh.boundaries:
            outline = np.setdiff1d(outline, mesh.f2e[:, mesh.boundaries[plane]])
    start, end = mesh.p[:, mesh.edges[:, outline]].transpose(1, 0, 2)
    return float(np.linalg.norm(end - start, axis=0).mean())
