"""The lowest modes of the sensor in its mount: how fast its tips ring, along the press and out of the plate.

One coarse mesh serves: the stiffness of each spring is known from finer ones, and f is proportional to its square root.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_matrix, kron
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh
from skfem import CellBasis

from sensor.arrays import Floats
from solve.displacement_basis import cell_nodes, scalar_shapes
from solve.elasticity import assemble_elements
from solve.housing.clamped_half import ACROSS, ClampedHalf, with_symmetry
from solve.housing.stiffness import SPRINGS, PerTip, stiffness_of, tip_face
from solve.linear import DIGITS, SolveError

COUNT = 3
# Of a mode in the norm of its mass: what round-off leaves at the largest condition number that a solve may have. The
# frequency is off by half of it at most, a sixtieth of the floor below.
RESIDUAL_LIMIT = DIGITS
# Of what the finer meshes' stiffness moves a mode along the press, and of every mode: tests/solve/housing/test_modes.py
ERROR_SHARE = 0.75
FLOOR = 0.003
_KRYLOV_VECTORS = 3 * COUNT + 1
_TOLERANCE = 1e-8  # of an eigenvalue as the iteration bounds it: well within what the residual is asked to be
_TONNES = 1e-9  # per mm^3, of 1 g/cm^3: with N and mm the unit of mass
_PRESS = "along the press"
_DIRECTIONS = ("along the tips", "out of the plane of the plate", _PRESS)  # x, y, z


@dataclass(frozen=True, kw_only=True)
class Solid:
    """A material: Young's modulus [MPa], Poisson's ratio [1], density [g/cm^3]."""

    E: float
    poisson: float
    density: float


@dataclass(frozen=True, kw_only=True)
class Modes:
    """The lowest modes, lowest first: frequencies [Hz], their relative errors [1], and in words what moves how."""

    frequencies_Hz: tuple[float, ...]
    errors: tuple[float, ...]
    shapes: tuple[str, ...]


def modes_of(half: ClampedHalf, solid: Solid, stiffness: PerTip) -> Modes:
    """Return the three lowest modes of a housing in its mount, given half of it and its material.

    `stiffness` is that of each tip on finer meshes [N/mm]. Both symmetries about the plane y = 0 are solved. Raises
    SolveError when the residual of a mode is too large.
    """
    mass = mass_matrix(half.basis, _TONNES * solid.density * half.material.relative_density)
    # Frequencies along the press are proportional to the root of the stiffness, which finer meshes know better. Each
    # factor has the name of the mode that it corrects.
    corrections = {}
    for spring, fine, coarse in zip(SPRINGS, stiffness, stiffness_of(half), strict=True):
        corrections[f"{spring} spring {_PRESS}"] = (fine / coarse) ** 0.5
    modes = []
    for part in (half, with_symmetry(half, ACROSS)):
        for frequency, shape in _lowest(part, mass):
            factor = corrections.get(shape, 1.0)
            relative_error = ERROR_SHARE * abs(factor - 1.0) + FLOOR
            modes.append((factor * frequency, relative_error, shape))
    frequencies, errors, shapes = zip(*sorted(modes)[:COUNT], strict=True)
    return Modes(frequencies_Hz=frequencies, errors=errors, shapes=shapes)


def mass_matrix(basis: CellBasis, density: float | Floats) -> csc_matrix:
    """Return the consistent mass matrix of a displacement basis [t from t/mm^3, mm], shape (dofs, dofs).

    The density is one number, or one for each cell.
    """
    shapes = scalar_shapes(basis)
    blocks = np.reshape(density, (-1, 1, 1)) * np.einsum("ap,bp,ep->eab", shapes, shapes, basis.dx, optimize=True)
    of_nodes = assemble_elements(blocks, cell_nodes(basis), basis.N // 3)
    return csc_matrix(kron(of_nodes, np.eye(3), format="csc"))


def _lowest(half: ClampedHalf, mass: csc_matrix) -> Iterator[tuple[float, str]]:
    """Yield frequency [Hz] and shape, in words, of the lowest modes of one symmetry; raises SolveError.

    They are the smallest eigenvalues lambda = (2 pi f)^2 of K x = lambda M x, by Lanczos's method on K^-1 M.
    """
    factor = half.factor
    free_mass = mass[factor.free][:, factor.free]
    inverse = LinearOperator(free_mass.shape, matvec=factor.back_substitute, dtype=np.float64)
    start = np.cos(np.arange(free_mass.shape[0], dtype=np.float64))  # the same each time, and no mode lacks it
    try:
        values, vectors = eigsh(
            factor.block, COUNT, free_mass, sigma=0.0, OPinv=inverse, v0=start, ncv=_KRYLOV_VECTORS, tol=_TOLERANCE
        )
    except ArpackNoConvergence as error:
        msg = f"modes: {error}; check the mesh and what holds the housing"
        raise SolveError(msg) from error
    for value, x in zip(values, vectors.T, strict=True):
        # each mode carries its own inertia: lambda K^-1 M x = x, in the norm of the mass
        difference = value * inverse.matvec(free_mass @ x) - x
        residual = float(np.sqrt((difference @ (free_mass @ difference)) / (x @ (free_mass @ x))))
        if not (value > 0.0 and residual <= RESIDUAL_LIMIT):
            msg = f"modes: residual {residual:.1e} must be at most {RESIDUAL_LIMIT:.0e}; check the mesh"
            raise SolveError(msg)
        u = np.zeros(half.basis.N)
        u[factor.free] = x
        yield float(np.sqrt(value)) / (2.0 * np.pi), _shape(half.basis, u)


def _shape(basis: CellBasis, u: Floats) -> str:
    """Return in words which tip moves most in a mode u (dofs,), and in which direction."""
    moved = np.empty((len(SPRINGS), 3))
    for tip, spring in enumerate(SPRINGS):
        face = basis.get_dofs(tip_face(spring))
        for axis in range(3):
            moved[tip, axis] = u[face.all(f"u^{axis + 1}")].mean()
    tip, axis = divmod(int(np.argmax(np.abs(moved))), 3)
    return f"{SPRINGS[tip]} spring {_DIRECTIONS[axis]}"
