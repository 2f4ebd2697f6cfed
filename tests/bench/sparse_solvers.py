"""Direct solvers on one symmetric matrix: what a factor costs, how full it is, how exact its answer.

`python tests/bench/sparse_solvers.py MATRIX.npz` prints the rows as JSON. It needs numpy and scipy alone and takes
each further package that its interpreter has, so that packages can be tried in an environment of their own.
"""

import functools
import importlib.util
import json
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace

import numpy as np
from scipy.sparse import csc_matrix, load_npz, triu
from scipy.sparse.linalg import splu

REPEATS = 5
LOADS = 4
AS_USED = "SuperLU, symmetric, rows falling, relax 1 (as used)"

Solve = Callable[[np.ndarray], np.ndarray]
Factorise = Callable[[csc_matrix], tuple[Solve, int]]  # to a solve and the nonzeros of the factor, 0 where not told


@dataclass(frozen=True, kw_only=True)
class SolverRow:
    """The least CPU seconds of a factor and of four loads [s], nonzeros of one triangle [1], relative residual [1]."""

    solver: str
    factor: float
    solve: float
    fill: int
    residual: float


def superlu(matrix, *, ordering="MMD_AT_PLUS_A", symmetric=True, **options):
    """Factorise by SciPy's SuperLU."""
    lu = splu(matrix, ordering, 0.0 if symmetric else None, options={"SymmetricMode": symmetric}, **options)
    return lu.solve, lu.L.nnz


def by_metis(matrix):
    """Factorise by SuperLU in the order of METIS's nested dissection."""
    import pymetis

    links = matrix.copy()
    links.setdiag(0.0)
    links.eliminate_zeros()
    order = np.array(pymetis.nested_dissection(pymetis.CSRAdjacency(links.indptr, links.indices))[0])
    lu = splu(csc_matrix(matrix[order][:, order]), "NATURAL", 0.0, relax=1, options={"SymmetricMode": True})
    back = np.argsort(order)
    return lambda right: lu.solve(right[order])[back], lu.L.nnz


def by_pardiso(matrix):
    """Factorise by the Cholesky factor of pypardiso, as the extra `fast` does."""
    import pypardiso

    solver, upper = pypardiso.PyPardisoSolver(mtype=2), triu(matrix, format="csr")
    solver.factorize(upper)
    return functools.partial(solver.solve, upper), int(solver.get_iparm(18))


def by_cholmod(matrix):
    """Factorise by CHOLMOD as cholespy brings it."""
    import cholespy

    kind = cholespy.MatrixType.CSC
    solver = cholespy.CholeskySolverD(matrix.shape[0], matrix.indptr, matrix.indices, matrix.data, kind)

    def solve(right):
        found = np.empty_like(right)
        solver.solve(right, found)
        return found

    return solve, 0


def by_qdldl(matrix):
    """Factorise by QDLDL, which takes one load at a time."""
    import qdldl

    solver = qdldl.Solver(matrix)
    return lambda right: np.column_stack([solver.solve(one) for one in right.T.copy()]), 0


@dataclass(frozen=True)
class Choice:
    """A solver, the package that it needs, and whether the rows of its matrix are numbered from last to first."""

    factorise: Factorise
    package: str = "scipy"
    falling: bool = False


SOLVERS = {
    AS_USED: Choice(functools.partial(superlu, relax=1), falling=True),
    "SuperLU, symmetric, rows falling": Choice(superlu, falling=True),
    "SuperLU, symmetric, relax 1": Choice(functools.partial(superlu, relax=1)),
    "SuperLU, symmetric": Choice(superlu),
    "SuperLU, symmetric, panels of 4": Choice(functools.partial(superlu, panel_size=4)),
    "SuperLU, COLAMD": Choice(functools.partial(superlu, ordering="COLAMD", symmetric=False)),
    "SuperLU, METIS": Choice(by_metis, "pymetis"),
    "pypardiso": Choice(by_pardiso, "pypardiso"),
    "CHOLMOD of cholespy": Choice(by_cholmod, "cholespy"),
    "QDLDL": Choice(by_qdldl, "qdldl"),
}


def measured(matrix: csc_matrix) -> list[SolverRow]:
    """Return a row for each solver that is installed; they take turns, and the least of some repeats counts."""
    solvers = {name: one for name, one in SOLVERS.items() if importlib.util.find_spec(one.package)}
    falling = csc_matrix(matrix[::-1][:, ::-1])
    falling.sort_indices()
    turns: dict[str, list[SolverRow]] = {name: [] for name in solvers}
    for _ in range(REPEATS):
        for name, choice in solvers.items():
            turns[name].append(_row(name, choice, falling if choice.falling else matrix))
    return [
        replace(rows[0], factor=min(row.factor for row in rows), solve=min(row.solve for row in rows))
        for rows in turns.values()
    ]


def _row(name: str, choice: Choice, matrix: csc_matrix) -> SolverRow:
    right = np.random.default_rng(0).standard_normal((matrix.shape[0], LOADS))
    start = time.process_time()
    solve, fill = choice.factorise(matrix)
    factorised = time.process_time()
    found = solve(right)
    done = time.process_time()
    residual = float(np.abs(matrix @ found - right).max() / (abs(matrix) @ np.abs(found)).max())
    return SolverRow(solver=name, factor=factorised - start, solve=done - factorised, fill=int(fill), residual=residual)


if __name__ == "__main__":
    json.dump([asdict(row) for row in measured(csc_matrix(load_npz(sys.argv[1])))], sys.stdout)
