import pytest

import pipeline.stages.contact
from cad.design.parameters import Fruit, Tips
from cad.quantity import InputError
from pipeline.stages.contact import contact_compliance
from solve.fruit.split import SplitDomainError

BLOCK, TIPS = Fruit(), Tips()
B_TYPE = Fruit(length_mm=20.0, width_mm=12.0, height_mm=20.0)
# three of the twelve scenes that tests/bench/bench_contact.py compares
SCENES = {
    "20 x 12 plan, 20 high": (B_TYPE, TIPS),
    "thin layer, nu 0.45": (Fruit(length_mm=16.0, width_mm=10.0, height_mm=2.0, poisson=0.45), TIPS),
    "near a side": (Fruit(length_mm=14.0, width_mm=8.0), Tips(spacing_mm=8.0, offset_mm=1.0)),
}


def paired(S):
    """Return the mean of s11 and s22 less s12."""
    return 0.5 * (S[0][0] + S[1][1]) - 0.5 * (S[0][1] + S[1][0])


@pytest.fixture(scope="module", params=SCENES)
def both(request):
    fruit, tips = SCENES[request.param]
    return contact_compliance(fruit, tips, "auto"), contact_compliance(fruit, tips, "direct")


def test_split_and_direct_agree_within_their_error_bars(both):
    split, direct = both
    assert split.method == "split"
    assert direct.method != "split"
    bars = 0.01 * (split.error_percent * paired(split.S) + direct.error_percent * paired(direct.S))
    assert abs(paired(split.S) - paired(direct.S)) <= bars
    bars = 0.01 * (split.s11_error_percent * split.S[0][0] + direct.s11_error_percent * direct.S[0][0])
    assert abs(split.S[0][0] - direct.S[0][0]) <= bars
    assert split.error_percent <= 0.1
    assert direct.error_percent <= 1.0


def test_a_wrong_method_would_be_seen(both):
    """A 2 % error of the split, as of a missing factor in crosstalk or a wrong modulus, leaves the sum of the bars."""
    split, direct = both
    bars = 0.01 * (split.error_percent * paired(split.S) + direct.error_percent * paired(direct.S))
    assert abs(1.02 * paired(split.S) - paired(direct.S)) > bars


def test_paper_block_takes_the_split_by_default():
    found = contact_compliance(BLOCK, TIPS)
    assert found.method == "split"
    assert "block of" not in found.status
    # s11 - s12 of two independent methods, see tests/solve/test_split.py
    assert paired(found.S) == pytest.approx(0.766603 - 0.010526, rel=1e-4)


@pytest.mark.parametrize(
    ("fruit", "tips", "says"),
    [
        (Fruit(shape="sphere", radius_mm=35.0, thickness_mm=12.0, height_mm=20.0), TIPS, "block of 20 x 20 x 12 mm"),
        (BLOCK, Tips(fillet_mm=0.1), "the tips count as a sharp cube of 1 mm"),
    ],
)
def test_curved_scenes_are_sized_by_their_flat_reference(fruit, tips, says):
    found = contact_compliance(fruit, tips)
    assert found.S == contact_compliance(BLOCK, TIPS).S
    assert says in found.status


def test_spherical_tips_are_sized_by_the_cylinder():
    found = contact_compliance(BLOCK, Tips(shape="sphere"))
    assert found.S == contact_compliance(BLOCK, Tips(shape="cylinder")).S
    assert "the tips count as a sharp cylinder of 1 mm" in found.status


def test_auto_turns_to_direct_outside_the_domain_and_says_why(monkeypatch):
    direct = contact_compliance(BLOCK, TIPS)
    monkeypatch.setattr(pipeline.stages.contact, "direct_compliance", lambda *_: direct)
    monkeypatch.setattr(pipeline.stages.contact, "fruit_meshes", lambda *_: ())
    found = contact_compliance(BLOCK, Tips(offset_mm=4.5))
    assert found.status.endswith("so solved by direct finite elements")
    assert "gap from tip to side face = 1 mm: must be at least 1.5 sides = 1.5 mm" in found.status
    assert found.S == direct.S


def test_split_outside_its_domain_is_refused_in_one_line():
    with pytest.raises(
        InputError, match=r"^gap from tip to side face = [^\n]*; solve by direct finite elements$"
    ) as one:
        contact_compliance(BLOCK, Tips(offset_mm=4.5), "split")
    assert isinstance(one.value.__cause__, SplitDomainError)


def test_unknown_method_is_refused():
    with pytest.raises(InputError, match=r"^contact method = 'magic': must be one of auto, split, direct; auto fits"):
        contact_compliance(BLOCK, TIPS, "magic")


def test_direct_serves_cylinders():
    """The circle is faceted on the meshes; radius and area tend to the true ones faster than the edge is resolved."""
    split, direct = (contact_compliance(BLOCK, Tips(shape="cylinder"), method) for method in ("split", "direct"))
    bars = 0.01 * (split.error_percent + direct.error_percent)
    assert abs(paired(split.S) / paired(direct.S) - 1.0) <= bars
