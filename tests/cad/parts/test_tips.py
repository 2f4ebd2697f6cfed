import math

import pytest

from cad.design.parameters import Tips
from cad.parts.tips import tip_parts

KERNEL = 1e-6


@pytest.mark.parametrize(
    ("tips", "volume", "touch"),
    [
        (Tips(side_mm=1.5), 1.5**2 * 3.0, 1.5**2),
        (Tips(shape="cylinder", side_mm=2.0), math.pi * 3.0, math.pi),
        (Tips(shape="sphere", side_mm=2.0), math.pi * 2.0 + 2.0 / 3.0 * math.pi, 2.0 * math.pi),
    ],
)
def test_tip_has_the_volume_and_the_face_of_its_shape(tips, volume, touch):
    for part, x in zip(tip_parts(tips, 3.0), (-4.0, 4.0), strict=True):
        assert part.shape.isValid()
        assert part.shape.Volume() == pytest.approx(volume, rel=1e-9)
        assert part.face_area("touch") == pytest.approx(touch, rel=1e-9)
        box = part.shape.BoundingBox()
        assert (box.zmin, box.zmax, box.center.x) == pytest.approx((0.0, 3.0, x), abs=KERNEL)


@pytest.mark.parametrize(("shape", "flat"), [("cube", (1.0 - 2 * 0.1) ** 2), ("cylinder", math.pi * (0.5 - 0.1) ** 2)])
def test_fillet_leaves_the_flat_inside_it(shape, flat):
    low, _ = tip_parts(Tips(shape=shape, fillet_mm=0.1), 2.0)
    faces = [face for face in low.shape.Faces() if face.geomType() == "PLANE" and abs(face.Center().z) < KERNEL]
    assert [face.Area() for face in faces] == [pytest.approx(flat, rel=1e-9)]
