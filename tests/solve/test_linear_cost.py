"""What a factor takes: a solve that would take too much is refused before it starts."""

import numpy as np
import pytest
from scipy.sparse import identity
from stand_ins import default_housing

from mesh.housing.sweep import flexure_mesh
from solve import linear
from solve.elasticity import vector_basis
from solve.linear import MOST_BYTES, SolveError, check_cost, factor_bytes, factorised


def test_factor_grows_as_that_of_a_cube_of_elements():
    """Nested dissection of n unknowns in space leaves n^(4/3) nonzeros: A. George, SIAM J. Numer. Anal. 10, 1973."""
    assert factor_bytes(8000) == pytest.approx(16.0 * factor_bytes(1000))


def test_dear_solve_is_refused_before_it_starts(monkeypatch):
    monkeypatch.setattr(linear, "splu", lambda *_: pytest.fail("it started"))
    monkeypatch.setattr(linear, "FACTOR_BYTES", 1e20)
    with pytest.raises(SolveError):
        factorised(identity(10, format="csc"), np.zeros(0, dtype=np.int64))


def test_machine_bounds_a_solve_too(monkeypatch):
    check_cost(10**5)
    monkeypatch.setattr(linear.os, "sysconf", {"SC_PAGE_SIZE": 4096, "SC_PHYS_PAGES": 2**17}.get)  # 512 MiB
    with pytest.raises(SolveError):
        check_cost(10**5)


def test_default_design_is_far_from_the_bound():
    """The mesh that its housing is solved on; that of its fruit has a tenth."""
    mesh = flexure_mesh(default_housing())
    assert factor_bytes(int(vector_basis(mesh, mesh.elem(), 2).N)) < 0.5 * MOST_BYTES
