import math
import os
import random
import re
import subprocess
import sys
from pathlib import Path

import cadquery as cq
import pytest

from cad.files.step import canonical, read_step, write_step
from cad.parts.sensor import Body

ROOT = Path(__file__).parents[3]
WRITE = """
import sys
from pathlib import Path
import cadquery as cq
from cad.files.step import write_step
from cad.parts.sensor import Body
held = [object() for _ in range(int(sys.argv[2]))]
box, dome = cq.Solid.makeBox(1, 2, 3), cq.Solid.makeSphere(1)
bodies = (Body(name="box", shape=box, colour=(1, 0, 0)), Body(name="dome", shape=dome, colour=(0, 1, 0.5)))
write_step(bodies, Path(sys.argv[1]) / "two.step", "pair")
"""


def two_bodies():
    box, dome = cq.Solid.makeBox(1, 2, 3), cq.Solid.makeSphere(1)
    return (Body(name="box", shape=box, colour=(1, 0, 0)), Body(name="dome", shape=dome, colour=(0, 1, 0.5)))


@pytest.mark.slow
def test_same_bytes_in_every_process_hash_seed_and_folder(tmp_path):
    here, there = tmp_path / "here", tmp_path / "a folder" / "of another name"
    for folder in (here, there):
        folder.mkdir(parents=True)
    write_step(two_bodies()[:1], here / "counted.step", "box")  # moves the counters of this process on
    write_step(two_bodies(), here / "two.step", "pair")
    environment = {**os.environ, "PYTHONHASHSEED": "7", "PYTHONPATH": str(ROOT)}
    subprocess.run(
        [sys.executable, "-c", WRITE, str(there), "12345"], env=environment, cwd=tmp_path, check=True, timeout=600
    )
    assert (here / "two.step").read_bytes() == (there / "two.step").read_bytes()


def test_names_colours_and_volume_come_back(tmp_path):
    write_step(two_bodies(), tmp_path / "two.step", "pair")
    back = cq.Assembly.importStep(str(tmp_path / "two.step"))
    assert back.name == "pair"
    assert {child.name for child in back.children} == {"box", "dome"}
    colours = {child.name: child.color.toTuple()[:3] for child in back.children}
    assert colours["box"] == pytest.approx((1.0, 0.0, 0.0), abs=1e-6)
    assert colours["dome"] == pytest.approx((0.0, 1.0, 0.5), abs=1e-6)
    volume = read_step(tmp_path / "two.step").Volume()
    assert volume == pytest.approx(6.0 + 2.0 / 3.0 * math.pi, rel=1e-9)


def test_header_holds_the_given_time_and_millimetres(tmp_path, monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")
    write_step(two_bodies()[:1], tmp_path / "one.step", "box")
    text = (tmp_path / "one.step").read_text()
    assert "'1970-01-02T00:00:00'" in text
    assert "AP242_MANAGED_MODEL_BASED_3D_ENGINEERING" in text
    assert "SI_UNIT(.MILLI.,.METRE.)" in text


def test_order_of_the_faces_survives(tmp_path, sensor):
    write_step((sensor.bodies()[0],), tmp_path / "housing.step", "housing")
    written = [face.Center().toTuple() for face in sensor.part.shape.Faces()]
    read = [face.Center().toTuple() for face in read_step(tmp_path / "housing.step").Faces()]
    assert len(read) == len(written)
    assert all(a == pytest.approx(b, abs=1e-9) for a, b in zip(read, written, strict=True))


def test_folder_that_is_missing_is_refused(tmp_path):
    with pytest.raises(OSError, match=r"cannot write .*none/a.step"):
        write_step(two_bodies()[:1], tmp_path / "none" / "a.step", "box")


def test_text_that_is_no_step_is_refused(tmp_path):
    (tmp_path / "a.step").write_text("hello")
    with pytest.raises(ValueError, match=r"a.step holds no shape that can be read"):
        read_step(tmp_path / "a.step")


PART21 = """ISO-10303-21;
HEADER;
ENDSEC;
DATA;
{data}
ENDSEC;
END-ISO-10303-21;
"""
ONE = """#1 = MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION('',(#2,#3),$);
#2 = STYLED_ITEM('it''s #4; red',(#4),#5);
#3 = STYLED_ITEM('blue',(#6),#5);
#4 = COLOUR(1.);
#6 = COLOUR(2.);
#5 = PRODUCT('Open CASCADE STEP translator 7.9 3');
#7 = NEXT_ASSEMBLY_USAGE_OCCURRENCE('12','a',#5);"""
OTHER = """#11 = NEXT_ASSEMBLY_USAGE_OCCURRENCE('4','a',
  #90);
#90 = PRODUCT('Open CASCADE STEP translator 7.9 8');
#40 = MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION('',(#3,
#20),$);
#20 = STYLED_ITEM('it''s #4; red',(#41),#90);
#3 = STYLED_ITEM('blue',(#60),#90);
#60 = COLOUR(2.);
#41 = COLOUR(1.);"""


def test_numbers_order_and_counts_are_taken_out():
    first, second = (canonical(PART21.format(data=data)) for data in (ONE, OTHER))
    assert first == second
    assert "'it''s #4; red'" in first
    assert canonical(first) == first


TIED = """#1 = MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION('',(#2,#3),#4);
#2 = STYLED_ITEM('color',(#5),#6);
#3 = STYLED_ITEM('color',(#7),#6);
#4 = CONTEXT('');
#5 = PRESENTATION_STYLE_BY_CONTEXT(#8);
#6 = SOLID('');
#7 = PRESENTATION_STYLE_BY_CONTEXT(#9);
#8 = SHAPE_REPRESENTATION('',#4);
#9 = SHAPE_REPRESENTATION('',#4);
#10 = SHAPE_DEFINITION_REPRESENTATION(#8);
#11 = SHAPE_DEFINITION_REPRESENTATION(#9);"""
TOLD_APART = "\n#12 = RELATION(#8,#9);"  # by their places in an entity that refers to them


def permuted(data, seed):
    """Return the entities in another order with other numbers, the two items of the unordered list in either order."""
    draw = random.Random(seed)
    lines = data.replace("(#2,#3)", draw.choice(["(#2,#3)", "(#3,#2)"])).splitlines()
    draw.shuffle(lines)
    numbers = draw.sample(range(1, 100), len(lines) + 1)
    return re.sub(r"#(\d+)", lambda match: f"#{numbers[int(match[1])]}", "\n".join(lines))


@pytest.mark.parametrize("data", [TIED, TIED + TOLD_APART])
def test_entities_of_equal_content_get_one_order(data):
    """A body that carries a place: OCCT writes its representation and its colour twice, alike but for their numbers."""
    assert len({canonical(PART21.format(data=permuted(data, seed))) for seed in range(40)}) == 1


def test_equal_content_referred_to_otherwise_stays_another_text():
    crossed = (TIED + TOLD_APART).replace("CONTEXT(#9)", "CONTEXT(#8)")
    assert canonical(PART21.format(data=TIED + TOLD_APART)) != canonical(PART21.format(data=crossed))


def test_another_content_stays_another_text():
    swapped = ONE.replace("COLOUR(1.)", "COLOUR(3.)")
    assert canonical(PART21.format(data=ONE)) != canonical(PART21.format(data=swapped))


def test_text_cut_short_is_refused():
    with pytest.raises(ValueError, match="no DATA section"):
        canonical("ISO-10303-21;\nHEADER;")


def test_entities_in_a_circle_are_refused():
    with pytest.raises(ValueError, match=r"STEP: entity #\d refers to itself"):
        canonical(PART21.format(data="#1 = A(#2);\n#2 = B(#3);\n#3 = C(#2);"))
