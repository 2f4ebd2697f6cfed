import dataclasses

import numpy as np
import pytest
from scipy.sparse import csc_matrix
from skfem import ElementTetP1, MeshTet

from sensor.machine_error import MachineError
from solve import linear
from solve.elasticity import stiffness_matrix, vector_basis
from solve.linear import CG_TOLERANCE, SolveError, check_cost, factorise

NONE = np.array([], dtype=np.int64)


def spd(rng, size=40):
    A = rng.normal(size=(size, size))
    return A @ A.T + size * np.eye(size)


def cube():
    mesh = MeshTet().refined(1)
    basis = vector_basis(mesh, ElementTetP1(), order=1)
    return stiffness_matrix(basis, 1.0, 0.3), basis


def test_prescribed_values_are_met_and_the_rest_is_in_balance(rng):
    K, load = spd(rng), rng.normal(size=40)
    fixed = np.array([3, 17, 5])
    factor = factorise(csc_matrix(K), fixed)
    values = np.array([1.0, -2.0, 0.5])  # in the order of factor.fixed
    u = factor.solve(load, values)
    assert np.array_equal(factor.fixed, [3, 5, 17])
    assert np.array_equal(u[factor.fixed], values)
    assert (K @ u - load)[factor.free] == pytest.approx(0.0, abs=1e-11)


@pytest.mark.parametrize(
    "wrong",
    [
        lambda good: lambda right: good(right) * (1.0 + 1e-3),
        lambda _: lambda right: np.zeros_like(right),
        lambda _: lambda right: np.full_like(right, np.nan),
        lambda good: lambda right: good(right)[::-1],
    ],
    ids=["off by a thousandth, squared by the refinement step", "zero", "nan", "reversed"],
)
def test_bad_solver_fails_the_residual_gate(rng, wrong):
    factor = factorise(csc_matrix(spd(rng)), NONE)
    planted = dataclasses.replace(factor, back_substitute=wrong(factor.back_substitute))
    with pytest.raises(SolveError):
        planted.solve(rng.normal(size=40))


def test_matrix_near_the_factorised_one_is_solved_as_a_dense_one(rng):
    K = spd(rng)
    loads = rng.normal(size=(40, 2))
    fixed = np.array([3, 17])
    factor = factorise(csc_matrix(K + np.diag(rng.uniform(0.0, 20.0, 40))), fixed)
    u = factor.solve_near(csc_matrix(K), loads)
    free = np.setdiff1d(np.arange(40), fixed)
    block = K[np.ix_(free, free)]
    exact = np.linalg.solve(block, loads[free])
    left = CG_TOLERANCE * np.linalg.norm(loads[free], axis=0) * np.linalg.norm(np.linalg.inv(block), 2)
    assert (np.linalg.norm(u[free] - exact, axis=0) <= left).all()
    assert not u[fixed].any()


def test_matrix_far_from_the_factorised_one_fails_the_residual_gate(rng, monkeypatch):
    monkeypatch.setattr(linear, "MOST_CG_STEPS", 3)
    factor = factorise(csc_matrix(np.eye(40)), NONE)
    with pytest.raises(SolveError):
        factor.solve_near(csc_matrix(spd(rng)), rng.normal(size=(40, 1)))


def test_exactly_singular_matrix_is_refused():
    with pytest.raises(SolveError):
        factorise(csc_matrix([[1.0, -1.0], [-1.0, 1.0]]), NONE)


@pytest.mark.parametrize("held", ["nothing", "one component"])
def test_part_that_can_move_freely_is_refused(held):
    K, basis = cube()
    fixed = NONE if held == "nothing" else basis.get_dofs(lambda x: x[0] < 1e-9).all("u^1")
    load = np.zeros(K.shape[0])
    load[basis.get_dofs(lambda x: x[2] > 1.0 - 1e-9).all("u^3")] = 1.0
    with pytest.raises(SolveError):
        factorise(K, fixed).solve(load)


def test_dear_solve_is_refused_before_it_starts(monkeypatch):
    monkeypatch.setattr(linear, "splu", lambda *_: pytest.fail("it started"))
    monkeypatch.setattr(linear, "FACTOR_BYTES", 1e20)
    with pytest.raises(SolveError):
        factorise(csc_matrix(np.eye(10)), NONE)


def test_machine_bounds_a_solve_too(monkeypatch):
    check_cost(10**5)
    monkeypatch.setattr(linear.os, "sysconf", {"SC_PAGE_SIZE": 4096, "SC_PHYS_PAGES": 2**17}.get)  # 512 MiB
    with pytest.raises(MachineError):
        check_cost(10**5)


@pytest.mark.parametrize(
    ("said", "error"),
    [("Factor is exactly singular", SolveError), ("SUPERLU_MALLOC fails for buf in intCalloc()", MemoryError)],
)
def test_lack_of_memory_is_no_singular_matrix(monkeypatch, said, error):
    def splu(*_, **__):
        raise RuntimeError(said)

    monkeypatch.setattr(linear, "splu", splu)
    with pytest.raises(error, match=said.split()[0]):
        factorise(csc_matrix(np.eye(10)), NONE)
