"""A direct finite-element solution for two rigid, flat, frictionless tips that are pressed on the fruit.

Under each tip, u_z is prescribed and the tangential displacements are free. The base is clamped.
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

Held = Mapping[str, Sequence[str]]  # displacement components that are fixed at 0, by the name of the boundary

EDGE_RATE = 1.0  # u ~ r^1/2 at the edge of a sharp tip, so the energy error is of first order in the size there
BALANCE_LIMIT = 1e-8  # largest unbalanced reaction, relative to the largest reaction
# Quadratic tetrahedra lock as nu approaches 0.5. MAX_POISSON is the largest nu that is solved. The relative error that
# remains after extrapolation from three meshes is a + b ((0.1 / (1 - 2 nu))^c - 1), and LOCKING holds a, b and c. These
# values were fitted to the split solution. The table of error bars has cases at nu = 0.4999.
MAX_POISSON = 0.4999
LOCKING = (4e-4, 3.2e-3, 0.4)
WIDEST_ERROR = 0.1  # largest relative error of the compliance with which degrees of ripeness can be distinguished
MIDDLE = "symmetry_x"  # plane of symmetry between the tips
SIDE = "symmetry_y"  # plane of symmetry through both tips
OFF_DIAGONAL = ~np.eye(len(TIPS), dtype=bool)  # the entries of a compliance between different tips
FACES = tuple(f"{name}_tip" for name in TIPS)
METHOD = "direct finite elements, quadratic tetrahedra, extrapolated"


def direct_compliance(meshes: Sequence[Mesh], poisson: float) -> FruitCompliance:
    """Return E times the compliance of the fruit [1/mm], extrapolated from three meshes [mm] of one family.

    The meshes are given from coarse to fine. All are meshes of the quarter x, y >= 0 (for centred tips), the half
    y >= 0, or the whole block. The boundaries of a mesh show which of these parts it covers. Raises SolveError if the
    finest mesh would need too much memory, if the solution is not accurate, or if the relative error exceeds 10 %.
    """
    start = time.perf_counter()
    relative_locking_error = locking_error(poisson)
    finest = meshes[-1]
    # Quadratic tetrahedra have three dofs at each corner and three at the midpoint of each edge.
    check_cost(3 * (finest.p.shape[1] + finest.edges.shape[1]))
    solutions = [mesh_compliance(mesh, poisson) for mesh in meshes]

    # The compliance of each tip under its own force is extrapolated to zero element size at its edge.
    sizes = [outline_size(mesh) for mesh in meshes]
    diagonals = np.array([np.diag(solution.S) for solution in solutions])
    limits = [richardson(values, sizes, EDGE_RATE) for values in diagonals.T.tolist()]
    worst = max(limits, key=lambda limit: limit.error)

    S, crosstalk_error = _finest_crosstalk(solutions[-1].S, solutions[-2].S)
    np.fill_diagonal(S, [limit.value for limit in limits])
    s11_minus_s12 = float(np.diag(S).mean() - S[OFF_DIAGONAL].mean())
    error = (worst.error + crosstalk_error) / s11_minus_s12 + relative_locking_error
    if not error <= WIDEST_ERROR:  # negated, so that nan is rejected too
        hint = "Use a thicker fruit, or tips farther from its edges."
        msg = f"contact: relative error of s11 - s12 = {error:.2g}: must be at most {WIDEST_ERROR:g}. {hint}"
        raise SolveError(msg)
    seconds = time.perf_counter() - start
    return FruitCompliance(
        S=S,
        difference_error=error,
        s11_error=limits[0].error / limits[0].value + relative_locking_error,
        info=SolveInfo(method=METHOD, dofs=solutions[-1].dofs, seconds=seconds, status=worst.status),
    )


def _finest_crosstalk(finest_S: Floats, coarser_S: Floats) -> tuple[Floats, float]:
    """Return the symmetric compliance on the finest mesh [1/mm], and the error of its crosstalk [1/mm].

    Both arguments are compliances (tips, tips) times E [1/mm]; the second is solved on the second finest mesh. The
    crosstalk hardly depends on the element size at the edges of the tips, so an extrapolation would only add noise. Its
    error is the largest change between the two meshes.
    """
    S = 0.5 * (finest_S + finest_S.T)
    change = np.abs(S - 0.5 * (coarser_S + coarser_S.T))
    return S, float(change[OFF_DIAGONAL].max())


def locking_error(poisson: float) -> float:
    """Return the relative error due to locking [1], by the fitted formula of `LOCKING`.

    Raises SolveError for a Poisson's ratio above `MAX_POISSON`.
    """
    if poisson > MAX_POISSON:
        reason = "because direct elements lock above it"
        msg = f"fruit.poisson = {poisson:.6g}: must be at most {MAX_POISSON:g}, {reason}. Use the split solution."
        raise SolveError(msg)
    start, growth, power = LOCKING
    return max(0.0, start + growth * (float((0.1 / (1.0 - 2.0 * poisson)) ** power) - 1.0))


def mesh_compliance(mesh: Mesh, poisson: float) -> MeshCompliance:
    """Return E times the compliance of the tips [1/mm], on one mesh [mm] of a quarter, a half or the whole block.

    Finite elements with prescribed displacements overestimate the stiffness, so no eigenvalue of the compliance exceeds
    the true one. Raises SolveError if the solution is not accurate.
    """
    basis = vector_basis(mesh, ElementTetP2(), order=2)
    K = stiffness_matrix(basis, 1.0, poisson)
    held: Held = {"base": ("u^1", "u^2", "u^3")}  # the components along x, y and z
    fraction = 1.0  # fraction of the force of a tip that the meshed part carries
    if SIDE in mesh.boundaries:
        held = {**held, SIDE: ("u^2",)}
        fraction = 0.5
    if MIDDLE not in mesh.boundaries:
        stiffness = tip_stiffness(basis, K, held, FACES)
        return MeshCompliance(fraction * np.asarray(np.linalg.inv(stiffness), dtype=np.float64), int(basis.N))
    # A quarter has only one tip. The conditions on the plane x = 0 determine whether its mirror image has the same
    # displacement (even mode) or the opposite displacement (odd mode). The compliances of these two modes are
    # s11 + s12 and s11 - s12. Half of each is used, so that their sum is s11 and their difference s12.
    even_stiffness = tip_stiffness(basis, K, {**held, MIDDLE: ("u^1",)}, FACES[1:])[0, 0]
    odd_stiffness = tip_stiffness(basis, K, {**held, MIDDLE: ("u^2", "u^3")}, FACES[1:])[0, 0]
    half_even = 0.5 * fraction / even_stiffness
    half_odd = 0.5 * fraction / odd_stiffness
    s11, s12 = half_even + half_odd, half_even - half_odd
    return MeshCompliance(np.array([[s11, s12], [s12, s11]]), int(basis.N))


def tip_stiffness(basis: CellBasis, K: csc_matrix, held: Held, faces: Sequence[str]) -> Floats:
    """Return the stiffness of the tips divided by E [mm], shape (faces, faces), from the stiffness matrix K for E = 1.

    Entry ij is the reaction on face i if face j is displaced by 1 along z and the other faces are held. `held` names
    the displacement components that are fixed at 0 on each boundary. Raises SolveError if the reactions do not balance,
    or if the stiffness is not symmetric.
    """
    tip_dofs = [basis.get_dofs(face).all("u^3") for face in faces]
    clamped_dofs = [basis.get_dofs(name).all(list(components)) for name, components in held.items()]
    factor = factorise(K, np.concatenate([*clamped_dofs, *tip_dofs]))
    # For each face, a displacement of 1 on its dofs, and of 0 on all other held dofs.
    prescribed = np.column_stack([np.isin(factor.fixed, dofs) for dofs in tip_dofs]).astype(np.float64)
    reactions = K @ factor.solve(np.zeros((basis.N, len(faces))), prescribed)
    stiffness = np.array([reactions[dofs].sum(axis=0) for dofs in tip_dofs])

    support_dofs = [basis.get_dofs(name).all("u^3") for name, components in held.items() if "u^3" in components]
    # A dof that is both under a tip and on a support belongs to the tip, and must not be counted twice.
    only_support_dofs = np.setdiff1d(np.concatenate(support_dofs), np.concatenate(tip_dofs))
    check_balance(stiffness, reactions[only_support_dofs].sum(axis=0))
    return stiffness


def check_balance(stiffness: Floats, support: Floats) -> None:
    """Raise SolveError unless the reactions balance and the stiffness is symmetric.

    Each column of `stiffness` (faces, faces) [mm] holds the reactions on the faces for one load, divided by E.
    `support` (faces,) [mm] holds the sum of the support reactions for each load, also divided by E. The stiffness must
    be symmetric by Betti's reciprocal theorem.
    """
    scale = float(np.abs(stiffness).max())
    unbalanced = float(np.abs(stiffness.sum(axis=0) + support).max())
    # Both comparisons are negated, so that nan is rejected too.
    if not unbalanced <= BALANCE_LIMIT * scale:
        msg = (
            f"contact: the reactions of tips and supports add up to {unbalanced / scale:.1e} of the largest reaction. "
            f"The sum must be at most {BALANCE_LIMIT:.0e}. Check that every support is named."
        )
        raise SolveError(msg)
    asymmetry = float(np.abs(stiffness - stiffness.T).max())
    if not asymmetry <= BALANCE_LIMIT * scale:
        msg = (
            f"contact: the reactions of the tips on each other differ by {asymmetry / scale:.1e} of the largest "
            f"reaction. The difference must be at most {BALANCE_LIMIT:.0e}. Check that the matrix is symmetric."
        )
        raise SolveError(msg)


def outline_size(mesh: Mesh) -> float:
    """Return the mean length of the mesh edges along the outlines of the tips [mm], except on planes of symmetry.

    An extrapolation needs the element size there, because the singularity at the edges of the tips dominates the error.
    """
    tip_facets = [mesh.boundaries[face] for face in FACES if face in mesh.boundaries]
    edges, facet_counts = np.unique(mesh.f2e[:, np.concatenate(tip_facets)], return_counts=True)
    outline = edges[facet_counts == 1]  # edges that belong to only one facet of a tip face
    for plane in (MIDDLE, SIDE):
        if plane in mesh.boundaries:
            outline = np.setdiff1d(outline, mesh.f2e[:, mesh.boundaries[plane]])
    start, end = mesh.p[:, mesh.edges[:, outline]].transpose(1, 0, 2)  # the ends of the edges, both (3, edges) [mm]
    return float(np.linalg.norm(end - start, axis=0).mean())
