"""What a study file says is what a study has: its variations, its points and its base; wrong ones are refused."""

import pytest
from refusal import refusal

from pipeline.study import read_study
from pipeline.study.points import point_count, points_of
from pipeline.study.variation import Choices, Normal, Range, setting_of_cell
from pipeline.study.wanted import level_of, wanted_value
from sensor.quantity import InputError


def test_study_file_is_read(written):
    study = read_study(written())
    assert (study.name, study.samples, study.seed, study.level) == ("springs", 8, 7, "contact")
    assert study.vary == {"targets.P_max": Range(low=3.0, high=8.0)}


@pytest.mark.parametrize(
    ("keys", "level"),
    [
        ([], "contact"),
        (["springs.K_l_N_per_m"], "contact"),
        (["verdicts.P_max.value"], "contact"),
        (["passed"], "files"),
        (["springs.K_l_N_per_m", "passed"], "files"),
    ],
)
def test_keys_ask_for_the_lowest_level_that_has_them_all(keys, level):
    assert level_of("wanted", keys) == level


def test_points_of_a_file_are_read_with_its_byte_order_mark(written, tmp_path):
    text = "targets.P_max,print.process\n4,fdm-petg\n\n6.5, sla-resin\n"
    (tmp_path / "some.csv").write_text(text, encoding="utf-8-sig")
    study = read_study(written('points = "some.csv"\nwanted = ["springs.K_l_N_per_m"]\n'))
    assert [dict(point.settings) for point in points_of(study)] == [
        {"targets.P_max": 4, "print.process": "fdm-petg"},
        {"targets.P_max": 6.5, "print.process": "sla-resin"},
    ]
    assert [setting_of_cell("any", cell) for cell in ("true", "[1, 2]", "1e-3")] == [True, (1, 2), 1e-3]


def test_points_of_a_file_may_have_decimal_commas(written, tmp_path):
    text = "targets.P_max;fruit.poisson;print.process\n3,5;0,3;fdm-petg\n4;0,25;sla-resin\n"
    (tmp_path / "some.csv").write_text(text, encoding="utf-8")
    study = read_study(written('points = "some.csv"\nwanted = ["springs.K_l_N_per_m"]\n'))
    assert [tuple(point.settings.values()) for point in points_of(study)] == [
        (3.5, 0.3, "fdm-petg"),
        (4, 0.25, "sla-resin"),
    ]


def test_process_file_never_varies(written):
    varied = written(**{"targets.P_max": "print.process_file", "{ from = 3, to = 8 }": '["own.toml"]'})
    assert refusal(read_study, varied).field == "vary.print.process_file"


def test_base_may_need_what_varies(written):
    """Half of a skin is given and half varies; where all of it cannot be a skin, the study is refused."""
    skin = {"seed = 7": 'set = { "fruit.skin_E_MPa" = 10.0 }', "targets.P_max": "fruit.skin_mm"}
    study = read_study(written(**skin, **{"from = 3, to = 8": "from = 0.1, to = 0.3"}))
    assert study.design is None
    assert study.base.design({"fruit.skin_mm": 0.2}).fruit.skin_E_MPa == 10.0
    with pytest.raises(InputError) as refused:
        read_study(written(**skin))  # of 3 to 8 mm on flesh of 12 mm
    assert (refused.value.field, refused.value.value) == ("fruit.skin_mm", 5.5)


def test_grid_takes_every_combination_with_both_ends(written):
    grid = 'to = 12, steps = 3, log = true }\n"targets.NL" = [0.04, 0.05]'
    study = read_study(written(**{"samples = 8": 'how = "grid"', "to = 8 }": grid}))
    points = list(points_of(study))
    assert [point.number for point in points] == list(range(6))
    assert [tuple(point.settings.values()) for point in points] == [
        (pytest.approx(P_max), NL) for P_max in (3.0, 6.0, 12.0) for NL in (0.04, 0.05)
    ]


def test_longer_study_begins_with_the_points_of_a_shorter_one(written):
    study = read_study(written(**{"samples = 8": "samples = 64"}))
    points = list(points_of(study))
    assert [point.number for point in points] == list(range(64))
    assert points == list(points_of(study))
    assert points[:8] == list(points_of(read_study(written())))


def test_points_of_sensitivities_are_two_samples_and_each_with_one_key_of_the_other(written):
    text = {
        "samples = 8": 'how = "sensitivity"\nsamples = 4',
        "to = 8 }": 'to = 8 }\n"targets.NL" = [0.04, 0.05, 0.06]',
    }
    study = read_study(written(**text))
    points = [tuple(point.settings.values()) for point in points_of(study)]
    assert len(points) == point_count(study) == 16
    sample_A, sample_B, exchanged = points[:4], points[4:8], points[8:]
    assert set(exchanged) == {
        pair for (a, b), (c, d) in zip(sample_A, sample_B, strict=True) for pair in ((c, b), (a, d))
    }
    assert list(points_of(study)) == list(points_of(study))


def test_distributions_have_their_quantiles():
    normal = Normal(mean=5.0, sd=0.2, source="a table")
    assert normal.at(0.5) == 5.0
    assert normal.at(0.975) == pytest.approx(5.0 + 1.959964 * 0.2, abs=1e-6)  # the 97.5 % quantile of tables
    for fraction, sign in ((0.0, -1.0), (1.0, 1.0)):
        assert normal.at(fraction) == pytest.approx(5.0 + sign * 5.9978 * 0.2, abs=1e-4)
    for span in (Range(low=2.0, high=8.0), Range(low=1.0, high=16.0, log=True)):
        assert [span.fraction_of(span.at(fraction)) for fraction in (0.0, 0.3, 1.0)] == pytest.approx([0.0, 0.3, 1.0])
    assert Range(low=2.0, high=8.0).at(0.25) == 3.5
    assert Range(low=1.0, high=16.0, log=True).at(0.25) == pytest.approx(2.0)
    assert [Choices(values=("a", "b")).at(fraction) for fraction in (0.0, 0.49, 0.5, 1.0)] == ["a", "a", "b", "b"]


@pytest.mark.parametrize(
    ("key", "level"),
    [
        *((f"verdicts.{name}.value", "contact") for name in ("P_max", "bruise", "P_monotonic", "geometry.tip_face")),
        *((key, "contact") for key in ("springs.K_l_N_per_m", "response.0.P.3", "reading.touch_fraction")),
        ("verdicts.reading.bias.error", "contact"),
        ("verdicts.reading.relaxation.passed", "contact"),
        ("verdicts.printable.low.passed", "contact"),
        ("verdicts.printable.low.value", "flexures"),
        *((key, "flexures") for key in ("verdicts.K_h.value", "flexures.low.dimensions_mm.length", "deflections_mm.0")),
        *((key, "files") for key in ("verdicts.geometry.valid.passed", "passed")),
    ],
)
def test_key_needs_no_more_than_its_level(key, level):
    assert level_of("wanted", [key]) == level
    assert level_of("wanted", [key, "springs.K_l_N_per_m"]) == level


def test_key_without_a_value_is_refused():
    absent = refusal(wanted_value, {"a": ({"b": 1.5},)}, "a.1.b")
    assert (absent.field, absent.value) == ("wanted", "a.1.b")
