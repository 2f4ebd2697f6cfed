import numpy as np
import pytest

from reference.flat_punch.tip_profile import RoundTip

TIPS = {"sharp": RoundTip(radius=0.5), "rounded": RoundTip(radius=0.5, edge=0.1)}


@pytest.mark.parametrize("tip", TIPS.values(), ids=TIPS)
def test_normal_and_curvature_are_derivatives(tip, rng):
    step = 1e-6
    # Away from the corner of a sharp tip and from the line on which wall and face are equally near.
    r, z = rng.uniform(0.42, 0.55, 200), rng.uniform(-0.02, 0.2, 200)
    across, down = r - tip.radius, -z
    smooth = (np.abs(across - down) > 0.01) & (np.hypot(across, down) > 0.01)
    r, z = r[smooth], z[smooth]
    here = tip.distance(r, z)
    for axis, (dr, dz) in enumerate(((step, 0.0), (0.0, step))):
        after, before = tip.distance(r + dr, z + dz), tip.distance(r - dr, z - dz)
        inside = here.value < 0.0  # of a sharp tip the distance outside its corner is not used
        slope = (after.value - before.value) / (2.0 * step)
        turn = (after.normal - before.normal) / (2.0 * step)
        np.testing.assert_allclose(here.normal[inside, axis], slope[inside], atol=1e-8)
        np.testing.assert_allclose(here.curvature[inside, :, axis], turn[inside], atol=1e-6)


def test_points_know_whether_wall_or_face_is_nearest():
    tip = RoundTip(radius=0.5, edge=0.1)
    r, z = np.array([0.1, 0.49, 0.47, 0.7]), np.array([0.01, 0.3, 0.03, 0.5])
    distance = tip.distance(r, z)
    np.testing.assert_allclose(distance.value, [-0.01, -0.01, np.hypot(0.07, 0.07) - 0.1, 0.2], atol=1e-15)
    assert distance.face.tolist() == [True, False, True, False]
