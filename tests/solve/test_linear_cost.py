"""What a factor takes: a solve that would take too much is refused before it starts."""

import numpy as np
import pytest
from scipy.sparse import identity

from solve import linear
from solve.linear import SolveError, check_cost, factorised


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
