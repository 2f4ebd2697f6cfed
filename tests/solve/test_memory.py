"""What a factor takes and what is free: against the kernel's own limit, and a solve that would take too much."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import identity
from stand_ins import default_housing

from cad.design.fruit import Fruit
from cad.design.tips import Tips
from mesh.housing.sweep import flexure_mesh
from pipeline.response.contact import contact_compliance
from solve import linear
from solve.elasticity import vector_basis
from solve.linear import MOST_BYTES, SolveError, check_cost, factorised
from solve.memory import factor_bytes, free_bytes

ROOT = Path(__file__).parents[2]
GIB = 2**30


def free_under_limit(limit: int) -> float:
    """Return what is free in a process that may have this many bytes of data."""
    program = f"""if True:
        import resource
        resource.setrlimit(resource.RLIMIT_DATA, ({limit}, {limit}))
        from solve.memory import free_bytes
        print(free_bytes())
    """
    words = [sys.executable, "-c", program]
    return float(subprocess.run(words, cwd=ROOT, check=True, capture_output=True, timeout=600).stdout)


def test_free_memory_is_less_than_the_machine_has_and_follows_a_limit():
    machine = 1024 * int(Path("/proc/meminfo").read_text(encoding="ascii").split()[1])
    assert 0.0 < free_bytes() <= machine
    least = min(machine, GIB)
    assert 0.5 * least < free_under_limit(least) < least


def test_factor_grows_as_that_of_a_cube_of_elements():
    """Nested dissection of n unknowns in space leaves n^(4/3) nonzeros: A. George, SIAM J. Numer. Anal. 10, 1973."""
    assert factor_bytes(8000) == pytest.approx(16.0 * factor_bytes(1000))


def test_dear_solve_is_refused_before_it_starts(monkeypatch):
    monkeypatch.setattr(linear, "_superlu", lambda _: pytest.fail("it started"))
    monkeypatch.setattr(linear, "check_cost", lambda unknowns: check_cost(unknowns * 10**5))
    with pytest.raises(
        SolveError, match=r"^linear solve: memory for 1000000 unknowns = [\d.]+ GiB: must be at most the"
    ):
        factorised(identity(10, format="csc"), np.zeros(0, dtype=np.int64))


def test_what_is_free_bounds_a_solve_too(monkeypatch):
    unknowns = 10**5
    check_cost(unknowns)
    monkeypatch.setattr(linear, "free_bytes", lambda: 0.5 * factor_bytes(unknowns))
    with pytest.raises(SolveError, match=r"GiB that are free; take a smaller fruit"):
        check_cost(unknowns)


def test_default_design_is_far_from_the_bound():
    """The mesh that its housing is solved on; that of its fruit has a tenth."""
    mesh = flexure_mesh(default_housing())
    assert factor_bytes(int(vector_basis(mesh, mesh.elem(), 2).N)) < 0.5 * MOST_BYTES


@pytest.mark.slow
def test_huge_fruit_is_refused_once_it_is_meshed(monkeypatch):
    """A plate of 1 m, its tips wider than it is high: 400 thousand unknowns."""
    monkeypatch.setattr("solve.fruit.direct.mesh_compliance", lambda *_: pytest.fail("it was solved"))
    plate, tips = (
        Fruit(length_mm=1e3, width_mm=1e3, height_mm=50.0),
        Tips(side_mm=60.0, spacing_mm=200.0, offset_mm=30.0),
    )
    with pytest.raises(SolveError, match=r"^linear solve: memory for [34]\d{5} unknowns = 1\d"):
        contact_compliance(plate, tips)
