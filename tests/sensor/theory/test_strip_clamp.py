import numpy as np
import pytest
from scipy.sparse import lil_matrix
from scipy.sparse.linalg import spsolve

from sensor.quantity import InputError
from sensor.theory.strip_clamp import StripClamp, clamp_share, half_compliance, unbonded_loss

CLAMP = StripClamp(
    length=4.5, end_room=0.5, gap=0.1, wall=1.5, corner=0.5, strip_E_MPa=206000.0, strip_poisson=0.29,
    strip_over_print_density=6.0, glue_E_MPa=2000.0, glue_poisson=0.36,
)  # fmt: skip
PETG = (2000.0, 0.38)


def guided_stiffness(length, give, clamp, unbonded=0.0):
    """Return K of a leaf of EI = 1 whose ends lie on springs, by cubic beam elements: the half from root to middle.

    The middle of a guided leaf has no moment: a unit force there, and the root free on its foundation k = 4 / give^4
    over the clamped length but for its last part.
    """
    step = 0.1 * give  # the deflection of an element is exact but for its foundation
    inside = round(clamp / step)
    outside = round(0.5 * length / step)
    h = np.repeat([clamp / inside, 0.5 * length / outside], [inside, outside])
    start = np.concatenate([[0.0], np.cumsum(h)[:-1]])
    k = np.where(start + 0.5 * h < clamp - unbonded, 4.0 / give**4, 0.0)
    count = len(h)
    K = lil_matrix((2 * count + 2, 2 * count + 2))
    for i, (a, foundation) in enumerate(zip(h, k, strict=True)):
        bent = np.array([[12, 6 * a, -12, 6 * a], [6 * a, 4 * a * a, -6 * a, 2 * a * a],
                         [-12, -6 * a, 12, -6 * a], [6 * a, 2 * a * a, -6 * a, 4 * a * a]]) / a**3  # fmt: skip
        held = foundation * a / 420 * np.array([[156, 22 * a, 54, -13 * a], [22 * a, 4 * a * a, 13 * a, -3 * a * a],
                         [54, 13 * a, 156, -22 * a], [-13 * a, -3 * a * a, -22 * a, 4 * a * a]])  # fmt: skip
        K[2 * i : 2 * i + 4, 2 * i : 2 * i + 4] += bent + held
    load = np.zeros(K.shape[0])
    load[-2] = 1.0
    return 0.5 / spsolve(K.tocsc(), load)[-2]  # two halves in series


@pytest.mark.parametrize(("length", "give"), [(16.0, 0.32), (10.0, 0.9)])
def test_clamps_give_as_a_beam_on_springs(length, give):
    """Of its end, 8 and 5 times 1 / beta inside, e^-5 is felt; the foundation cuts both ends of the leaf alike."""
    rigid = 12.0 / length**3
    found = guided_stiffness(length, give, 8.0 * give) / rigid
    half = 0.5 * length
    assert half_compliance(half, 0.0) / half_compliance(half, give) == pytest.approx(found, rel=1e-3)


@pytest.mark.parametrize(("length", "give"), [(16.0, 0.32), (23.0, 0.47)])
def test_glue_that_misses_the_shoulders_costs_as_a_beam_says(length, give):
    clamp = 10.0 * give
    part = 1.0
    whole, without = (guided_stiffness(length, give, clamp + part, unbonded=missing) for missing in (0.0, part))
    assert unbonded_loss(length, give, part) == pytest.approx(1.0 - without / whole, rel=2e-2)


def test_a_rigid_print_gives_only_by_its_glue_and_a_rigid_glue_by_the_print():
    """Half as stiff a print makes the give longer by the cube root of 2, where the glue is rigid."""
    hard = StripClamp(**{**vars(CLAMP), "glue_E_MPa": 1e6})
    ratio = hard.give(0.1, 1000.0, 0.38) / hard.give(0.1, 2000.0, 0.38)
    assert ratio == pytest.approx(2.0 ** (1.0 / 3.0), rel=1e-2)
    assert CLAMP.give(0.1, 1e9, 0.38) < 0.6 * CLAMP.give(0.1, *PETG)
    assert clamp_share(20.0, CLAMP.give(0.1, *PETG)) < 0.04


def test_a_clamp_too_short_for_its_strip_is_refused():
    CLAMP.check_length(0.3, *PETG)
    with pytest.raises(InputError) as refused:
        CLAMP.check_length(0.4, *PETG)
    assert refused.value.field == "print.clamp_mm"
    with pytest.raises(InputError):
        StripClamp(**{**vars(CLAMP), "gap": 0.0})
