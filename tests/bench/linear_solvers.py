"""The matrices of a cold run, factorised by every direct solver at hand.

From the root of the repository, one thread: `OMP_NUM_THREADS=1 python tests/bench/linear_solvers.py
[--python INTERPRETER] --out docs` writes linear-solvers.md into a folder. Another interpreter, which needs numpy and
scipy only, has the solvers that are tried; it takes a minute.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from scipy.sparse import csc_matrix, save_npz
from skfem import ElementHex2

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from bench.sparse_solvers import AS_USED, LOADS, REPEATS, SolverRow  # noqa: E402

from cad.design.parameters import Design  # noqa: E402
from mesh.housing.sweep import flexure_mesh  # noqa: E402
from pipeline.bench.bench import OUT  # noqa: E402
from pipeline.bench.flexure import E_MPA, HOUSING, POISSON  # noqa: E402
from pipeline.bench.table import Sheet, page, publish  # noqa: E402
from pipeline.springs.mounts import MOUNT_SCALE, attached_to  # noqa: E402
from solve.elasticity import stiffness_matrix, vector_basis  # noqa: E402
from solve.fruit.box import block_lines, box_mesh  # noqa: E402
from solve.fruit.remainder import VOLUME_ORDER, mirror_dofs  # noqa: E402
from solve.fruit.split import LEVELS  # noqa: E402
from solve.housing.clamped_half import clamped_half  # noqa: E402
from solve.linear import factorised  # noqa: E402

WORKER = Path(__file__).with_name("sparse_solvers.py")
DEADLINE = 600.0  # [s] for one matrix
HEADS = ("solver", "factor CPU s", "4 loads CPU s", "nonzeros, million", "residual")
INTRODUCTION = f"""\
`tests/bench/linear_solvers.py` writes this page: the stiffness matrices that a cold run factorises, each by the direct
solvers that its interpreter has. Solvers take turns, and the least CPU seconds of {REPEATS} turns on one thread count;
a factor's include its ordering. Nonzeros are those of one triangle of the factor, where the solver tells them.
The residual is that of {LOADS} loads before any refinement, relative to |K||u|.

What the tables say:

- Minimum degree on K + K' leaves half the fill of COLAMD and no more than nested dissection: the plates are thin.
- `relax` joins columns at the bottom of the elimination tree; the columns of three displacements are alike already, and
  to join more of them is work on zeros. With 1 nothing is joined.
- Dofs numbered from last to first, middles of edges before corners, fill a little less: where degrees are equal, the
  ordering takes what comes first.
- A Cholesky factor has half the arithmetic of SuperLU's, yet none that installs from a wheel is cheaper by more than
  a twentieth here. pypardiso, which draws level on the largest matrix, takes some tenths of a second to start as well:
  it stays the extra `fast`, for larger ones.

Not measured: scikit-sparse has no wheel and needs the headers of SuiteSparse; the wheel of python-mumps asks for
numpy 1. Nor was condensing the middles of elements: 20-node bricks have none, and minimum degree takes those of the
fruit's 27-node bricks first."""


def matrices() -> Iterator[tuple[str, csc_matrix]]:
    """Yield the name and the matrix of each solve of the default design."""
    for scale in (1.0, 2.0, MOUNT_SCALE):
        half = clamped_half(flexure_mesh(HOUSING, scale), E_MPA, POISSON, attached_to(HOUSING))
        yield f"Flexures, mesh of scale {scale:g}", half.factor.block
    yield "Fruit, remainder of the half-space", _remainder()


def _remainder() -> csc_matrix:
    fruit, tips = Design().fruit, Design().tips
    extent = (fruit.length_mm, fruit.width_mm, fruit.height_mm)
    lines = block_lines(extent, np.array(tips.places_mm), (True, True), LEVELS[0])
    basis = vector_basis(box_mesh(lines), ElementHex2(), VOLUME_ORDER)
    held = np.union1d(basis.get_dofs("base").all(), mirror_dofs(basis, (1, 1)))
    return factorised(stiffness_matrix(basis, 1.0, fruit.poisson, b_bar=True), held).block


def solver_rows(matrix: csc_matrix, interpreter: str) -> list[SolverRow]:
    """Return what the worker finds under an interpreter; raises CalledProcessError or TimeoutExpired."""
    rising = csc_matrix(matrix[::-1][:, ::-1])  # the product numbers its rows from last to first
    rising.sort_indices()
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "matrix.npz"
        save_npz(path, rising)
        command = [interpreter, str(WORKER), str(path)]
        ran = subprocess.run(command, capture_output=True, text=True, check=True, timeout=DEADLINE)
    return [SolverRow(**row) for row in json.loads(ran.stdout)]


def sheet(name: str, unknowns: int, rows: Sequence[SolverRow]) -> Sheet:
    """Return the table of one matrix, what is used first, then the cheapest factor first."""
    ordered = sorted(rows, key=lambda row: (row.solver != AS_USED, row.factor))
    cells = [
        (
            row.solver,
            f"{row.factor:.3f}",
            f"{row.solve:.4f}",
            f"{1e-6 * row.fill:.2f}" if row.fill else "-",
            f"{row.residual:.0e}",
        )
        for row in ordered
    ]
    return Sheet(name=name, title=f"{name}, {unknowns} unknowns", heads=HEADS, rows=tuple(cells))


def main(arguments: Sequence[str]) -> int:
    """Write and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--python", default=sys.executable, help="interpreter that has the solvers (default: this one)")
    parser.add_argument("--out", type=Path, default=OUT, help=f"folder of the page (default {OUT})")
    asked = parser.parse_args(arguments)
    tables = [sheet(name, matrix.shape[0], solver_rows(matrix, asked.python)) for name, matrix in matrices()]
    text = page("Linear solvers", INTRODUCTION, *(table.markdown() for table in tables))
    publish(asked.out, {"linear-solvers.md": text}, as_json=False)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
