import numpy as np
import pytest

import solve.halfspace.punch
from solve.halfspace.punch import circle_punch, graded_edges, square_punch

PUNCHES = {"square": square_punch, "circle": circle_punch}


@pytest.mark.parametrize("nodes", [2, 3, 5, 9])
@pytest.mark.parametrize("shape", PUNCHES)
def test_table_is_symmetric_positive_and_mirror_symmetric(shape, nodes):
    table = PUNCHES[shape](nodes)
    Y = table.stiffness
    np.testing.assert_array_equal(Y, Y.T)
    assert np.linalg.eigvalsh(Y)[0] > 0.0
    np.testing.assert_allclose(Y, Y[::-1, ::-1], atol=1e-12)


def tilt_stiffness(punch):
    """Return M / (E* theta side^3) of a punch turned about its y axis."""
    x = punch.nodes[:, 0]
    return x @ punch.stiffness @ x


@pytest.mark.parametrize("shape", PUNCHES)
def test_stiffness_does_not_depend_on_the_number_of_nodes(shape):
    flat = [PUNCHES[shape](nodes).flat_stiffness for nodes in (1, 3, 5, 9)]
    np.testing.assert_allclose(flat, flat[0], rtol=1e-11)
    tilt = [tilt_stiffness(PUNCHES[shape](nodes)) for nodes in (2, 3, 5, 9)]
    np.testing.assert_allclose(tilt, tilt[0], rtol=1e-11)


@pytest.mark.parametrize("shape", PUNCHES)
def test_interpolation_reproduces_polynomials(shape, rng):
    table = PUNCHES[shape](3)
    points = rng.uniform(-0.5, 0.5, (20, 2))
    for i in range(3):
        for j in range(3):
            values = table.nodes[:, 0] ** i * table.nodes[:, 1] ** j
            exact = points[:, 0] ** i * points[:, 1] ** j
            np.testing.assert_allclose(table.interpolate(points) @ values, exact, atol=1e-12)


def test_three_nodes_carry_the_moments_of_the_flat_punch_to_fourth_order():
    """At nodes chosen as Gauss points the forces of nine nodes have the moments of the pressure itself."""
    few, many = square_punch(3), square_punch(9)
    for power in (2, 4):
        moments = [table.nodes[:, 0] ** power @ table.stiffness.sum(axis=1) for table in (few, many)]
        # the forces are extrapolated, the Gauss points belong to the finer grid: fourth moments differ by 7e-4
        np.testing.assert_allclose(moments[0], moments[1], rtol=1e-12 if power == 2 else 1e-3)


def test_graded_edges_are_their_own_mirror_image_to_the_last_bit():
    for cells in (12, 13, 18, 32):
        edges = graded_edges(cells)
        np.testing.assert_array_equal(edges, -edges[::-1])
        pairs = solve.halfspace.punch.influence(edges, edges)
        np.testing.assert_array_equal(pairs, pairs[::-1, ::-1])


def test_boundary_elements_converge_at_order_three(monkeypatch):
    exact = square_punch(1).flat_stiffness  # before the grids change: it is kept for all other tests
    flat = []
    for cells in ((4, 8), (8, 16), (16, 32)):
        monkeypatch.setattr(solve.halfspace.punch, "CELLS", cells)
        monkeypatch.setattr(solve.halfspace.punch, "ORDER", np.inf)  # no extrapolation: the finer grid itself
        flat.append(square_punch.__wrapped__(1).flat_stiffness)
    errors = exact - np.array(flat)
    rates = np.log2(errors[:-1] / errors[1:])
    assert np.all(np.abs(rates - 3.0) < 0.25)
