"""The page of linear solvers: its rows are solves of the matrix, and a solver that answers wrongly is seen."""

from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import csc_matrix
from scripts import loaded_script

FOLDER = Path(__file__).parent
PAGE = FOLDER.parents[1] / "docs" / "linear-solvers.md"


@pytest.fixture
def solvers():
    return loaded_script(FOLDER / "sparse_solvers.py")


def chain(size):
    return csc_matrix(2.5 * np.eye(size) - np.eye(size, k=1) - np.eye(size, k=-1))


def test_each_solver_at_hand_has_a_row_with_its_residual(solvers, monkeypatch):
    monkeypatch.setattr(solvers, "REPEATS", 2)
    wrong = solvers.Choice(lambda matrix: (lambda right: 1.001 * np.linalg.solve(matrix.toarray(), right), 7))
    absent = solvers.Choice(solvers.superlu, "no_such_package")
    monkeypatch.setattr(solvers, "SOLVERS", {**solvers.SOLVERS, "planted": wrong, "absent": absent})
    rows = {row.solver: row for row in solvers.measured(chain(12))}
    assert rows["planted"].residual > 1e-4
    assert rows["planted"].fill == 7
    assert "absent" not in rows
    # a chain fills nothing whatever its numbering: the diagonal and one link to each row but the first
    assert rows[solvers.AS_USED].fill == 12 + 11
    assert all(row.residual < 1e-14 for name, row in rows.items() if name != "planted")


def test_page_has_four_matrices_each_led_by_what_is_used(solvers):
    lines = PAGE.read_text(encoding="utf-8").splitlines()
    leading = [lines[place + 4] for place, line in enumerate(lines) if line.startswith("## ")]
    assert len(leading) == 4
    assert all(line.startswith(f"| {solvers.AS_USED} |") for line in leading)
