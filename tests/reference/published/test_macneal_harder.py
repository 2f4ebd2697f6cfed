"""Straight, curved and twisted beams of MacNeal and Harder on the product's 20-node hexahedra.

R. H. MacNeal, R. L. Harder, A proposed standard set of problems to test finite element accuracy,
Finite Elements in Analysis and Design 1 (1985) 3-20, doi:10.1016/0168-874X(85)90003-4. Inches and pounds, as published.
The tip answer is load . u for a unit load spread over the end face, so it is conjugate to the load.
"""

import numpy as np
import pytest
from skfem import ElementHexS2

from solve.elasticity import stiffness_matrix, vector_basis
from solve.linear import factorise

FULL, REDUCED = 5, 3  # polynomial degrees: 3^3 and 2^3 Gauss points
LENGTH, WIDTH, THICKNESS = 6.0, 0.2, 0.1  # straight beam: x, y (in plane), z
INNER, OUTER = 4.12, 4.32  # radii of the curved beam
SPAN, BROAD, DEEP = 12.0, 1.1, 0.32  # twisted beam

REFERENCE = np.array([3.0e-5, 0.1081, 0.4321, 0.03208])  # extension, shear in and out of the plane, twist
LEANS = {"regular": 7 * [0], "trapezoid": [0, 1, -1, 1, -1, 1, 0], "parallelogram": [0, 1, 1, 1, 1, 1, 0]}
HEX20 = {
    "regular": (0.994, 0.970, 0.961, 0.904),
    "trapezoid": (0.994, 0.886, 0.920, 0.904),
    "parallelogram": (0.994, 0.967, 0.941, 0.904),
}
"""Tip answer over the reference that the 20-node brick with 3^3 points has on 6 x 1 x 1 elements, as published."""

ROUNDING = 6e-4  # of three published digits
COARSE = (6, 1, 1)
REFINED = [pytest.param(FULL, (24, 4, 4), marks=pytest.mark.slow), (REDUCED, (12, 2, 2))]
# A clamped solid is stiffer than the beam of the reference: its section cannot swell or warp at the root.
CLAMP = 0.008


def straight(shape):
    """Return the map of the straight beam; inner element ends lean by 45 degrees, alternating or all one way."""

    def place(x):
        X, (y, z) = LENGTH * x[0], (x[1:] - 0.5) * [[WIDTH], [THICKNESS]]
        return np.stack([X + np.interp(X, np.arange(7.0), LEANS[shape]) * y, y, z])

    return place


def ring(x):
    """Return the quarter ring: along its arc, across its radius, thickness in z; its end looks along -y."""
    r = INNER + (OUTER - INNER) * x[1]
    angle = 0.5 * np.pi * x[0]
    return np.stack([r * np.sin(angle), r * np.cos(angle), THICKNESS * x[2]])


def twisted(x):
    """Return the bar whose section turns by 90 degrees from root to tip."""
    angle = 0.5 * np.pi * x[0]
    y, z = BROAD * (x[1] - 0.5), DEEP * (x[2] - 0.5)
    return np.stack([SPAN * x[0], y * np.cos(angle) - z * np.sin(angle), y * np.sin(angle) + z * np.cos(angle)])


def force(axis, area):
    """Return the traction of a unit force on an end of the given area."""
    return lambda x: np.eye(3)[axis][:, None, None] / area + 0.0 * x


def moment(x):
    """Return the traction of a unit moment about the axis of the straight beam; its conjugate is the mean rotation."""
    polar = WIDTH * THICKNESS * (WIDTH**2 + THICKNESS**2) / 12.0
    return np.stack([0.0 * x[0], -x[2], x[1]]) / polar


def rectangle_torsion(a, b):
    """Return J of a rectangle, longer side a: Timoshenko, Goodier, Theory of Elasticity (1970), article 109."""
    n = np.arange(1, 40, 2)
    return a * b**3 / 3.0 * (1.0 - 192.0 * b / (np.pi**5 * a) * np.sum(np.tanh(n * np.pi * a / (2.0 * b)) / n**5))


def ring_deflection(E):
    """Return the deflection of a quarter ring in plane stress under a radial unit force: ibid., article 33."""
    squares = INNER**2 + OUTER**2
    return np.pi * squares / (E * THICKNESS * (INNER**2 - OUTER**2 + squares * np.log(OUTER / INNER)))


@pytest.fixture(scope="module")
def tips(mapped_hexes, face_load):
    """Return a function that clamps one end and gives the tip answers to unit loads on the other."""

    def solve(place, counts, material, loads, order=FULL, element=ElementHexS2):
        basis = vector_basis(mapped_hexes(place, counts), element(), order)
        clamped = factorise(stiffness_matrix(basis, *material), basis.get_dofs("x=0").all())
        f = np.stack([face_load(basis, "x=1", load) for load in loads], axis=1)
        return np.sum(f * clamped.solve(f), axis=0)

    return solve


@pytest.fixture(scope="module")
def straight_tips(tips):
    """Return a function that gives the four tip answers of the straight beam."""
    loads = [*(force(axis, WIDTH * THICKNESS) for axis in range(3)), moment]

    def solve(shape, counts, order=FULL, element=ElementHexS2, material=(1e7, 0.3)):
        return tips(straight(shape), counts, material, loads, order, element)

    return solve


@pytest.mark.parametrize("shape", HEX20)
def test_straight_beam_gives_what_was_published_for_this_element(straight_tips, shape):
    found = straight_tips(shape, COARSE)
    np.testing.assert_allclose(found / REFERENCE, HEX20[shape], atol=ROUNDING)


@pytest.mark.parametrize(("order", "counts"), REFINED)
@pytest.mark.parametrize("shape", HEX20)
def test_straight_beam_converges_to_the_references(straight_tips, shape, order, counts):
    found = straight_tips(shape, counts, order)
    np.testing.assert_allclose(found[:3] / REFERENCE[:3], 1.0, atol=CLAMP)


@pytest.mark.parametrize(
    ("order", "counts"), [pytest.param(FULL, (24, 4, 4), marks=pytest.mark.slow), (REDUCED, (24, 4, 4))]
)
def test_twist_converges_to_saint_venant(straight_tips, order, counts):
    """The published .03208 is 6 % under the series of Saint-Venant, as solids on fine meshes show."""
    found = straight_tips("regular", counts, order)[3]
    assert found == pytest.approx(LENGTH / (1e7 / 2.6 * rectangle_torsion(WIDTH, THICKNESS)), rel=CLAMP)
    assert found / REFERENCE[3] == pytest.approx(1.06, abs=0.01)


def test_curved_beam(tips):
    """The published in-plane .08734 is 1.4 % under the exact ring in plane stress; the solid converges to the ring."""
    loads = [force(0, WIDTH * THICKNESS), force(2, WIDTH * THICKNESS)]
    in_plane, out_of_plane = tips(ring, (24, 4, 4), (1e7, 0.25), loads, REDUCED)
    assert in_plane == pytest.approx(0.08734, rel=0.015)
    assert in_plane == pytest.approx(ring_deflection(1e7), rel=0.002)
    assert out_of_plane == pytest.approx(0.5022, rel=0.01)


@pytest.mark.parametrize(("order", "counts", "tolerance"), [(FULL, (12, 2, 1), 0.01), (REDUCED, (24, 4, 2), 0.002)])
def test_twisted_beam(tips, order, counts, tolerance):
    loads = [force(2, BROAD * DEEP), force(1, BROAD * DEEP)]
    found = tips(twisted, counts, (29e6, 0.22), loads, order)
    np.testing.assert_allclose(found, [0.005424, 0.001754], rtol=tolerance)
