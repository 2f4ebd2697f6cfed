"""The page of a study stands by itself, its links lead to designs that load; its tables are those of the store."""

import json
import re
from typing import Any

import pytest
from browser import grave_findings, validator_findings

from pipeline.options import load_design
from pipeline.study import read_study
from pipeline.study.points import points_of
from pipeline.study.store import study_store
from pipeline.study.study_page import MAX_DOTS, is_part_of_limit, shown_keys, write_page
from pipeline.study.tasks import PointResult

TWO = '"targets.P_max" = { from = 3, to = 8 }\n"targets.NL" = { from = 0.03, to = 0.08 }'


FRONT = """
base = "mango"
[vary]
"press.travel_mm" = { from = 0.3, to = 0.5 }
"print.process" = ["fdm-petg", "sla-resin"]
[optimise]
[optimise.front]
"fruit.bruise_limit_MPa" = [[0.05, 0.1, 0.2, 0.3], [0.06, 0.1, 0.2, 0.3], [0.04, 0.1, 0.2, 0.3]]
"""


def planted(study):
    """Yield points whose numbers follow formulas; every tenth is refused, each with a number of its own."""
    for point in points_of(study):
        P_max = float(str(point.settings["targets.P_max"]))
        refused = point.number % 10 == 9
        yield PointResult(
            number=point.number,
            settings=point.settings,
            status="refused" if refused else "done",
            values={} if refused else {"springs.K_l_N_per_m": 1e3 / P_max, "springs.K_h_N_per_m": 7.0},
            error=f"targets.P_max = {P_max:g} must be another" if refused else None,
            seconds=0.0,
        )


def many(written, samples):
    """Return a study of so many points over two keys."""
    text = {'"targets.P_max" = { from = 3, to = 8 }': TWO, "samples = 8": f"samples = {samples}"}
    return read_study(written(**text))


def data_of(page):
    """Return what the scripts of a page read."""
    found = re.search(r'id="data">(.*?)</script>', page.read_text(encoding="utf-8"))
    assert found is not None
    data: dict[str, Any] = json.loads(found[1])
    return data


def test_page_of_many_points_is_small_and_leads_to_the_best(written, tmp_path):
    study = many(written, 5_000)
    with study_store(tmp_path / "out", study) as store:
        store.put(planted(study))
        page = write_page(store, study)
        values = {row.number: row.values["springs.K_l_N_per_m"] for row in store.rows() if row.status == "done"}
    text = page.read_text(encoding="utf-8")
    assert len(text) < 1_000_000
    table = re.findall(
        r'<tr><th scope="row">([\w.<>]+)(?: <span.*?</span>)?</th><td class="number">([\w. ]+)</td>', text
    )
    spans = {name.replace("<wbr>", ""): span for name, span in table}
    assert spans["springs.K_h_N_per_m"] == "7"  # the same at every point
    assert re.fullmatch(r"[\d.]+ to [\d.]+", spans["springs.K_l_N_per_m"])
    links = re.findall(r'<a href="([^"]+)">(\d+)</a>', text)
    assert [int(number) for _, number in links] == sorted(values, key=lambda number: values[number])[:10]
    for link, number in links:
        assert 1e3 / load_design(tmp_path / "out" / link).nominal_targets.P_max == values[int(number)]
    data = data_of(page)
    shown = {point["number"]: point["springs.K_l_N_per_m"] for point in data["points"]}
    assert MAX_DOTS <= len(shown) <= MAX_DOTS + 10
    assert shown.items() <= values.items()
    assert data["axes"] == ["targets.P_max", "targets.NL", "springs.K_l_N_per_m"]  # K_h is the same at every point
    assert min(shown) < 1_000 < 4_000 < max(shown)  # drawn from all points, not from the first ones


def test_page_shows_what_varies_and_what_was_asked_for_alone(written, tmp_path):
    """The error, limit and outcome of a verdict stand beside its value; a unit stands where the key has none."""
    study = read_study(written(FRONT))
    with study_store(tmp_path / "out", study) as store:
        for number, travel in enumerate((0.3, 0.5)):
            store.put([PointResult(number=number, settings={"press.travel_mm": travel}, status="done")])
        shown = shown_keys(study, store)
    assert [one.key for one in shown if one.varies] == list(study.vary)
    asked = [f"verdicts.{name}.value" for name in study.goal.under]
    assert sorted(one.key for one in shown if not one.varies) == sorted(asked)
    assert (shown[0].label, shown[0].low, shown[0].high) == ("press.travel_mm", 0.3, 0.5)
    assert "bruise [MPa]" in {one.label for one in shown}
    assert is_part_of_limit("verdicts.bruise.limit")
    assert not is_part_of_limit("verdicts.P_max.limit")


@pytest.mark.slow
def test_browser_draws_a_front_at_the_first_numbers_of_its_lists(written, open_page, tmp_path):
    study = read_study(written(FRONT))
    out = tmp_path / "out"
    minimised = study.goal.minimise
    with study_store(out, study) as store:
        for number in range(30):
            settings = study.settings_at([number / 30, number % 2, (number % 3 + 0.5) / 3])
            values = {**dict.fromkeys(study.wanted, True), minimised: 0.1 + number / 1e3}
            store.put([PointResult(number=number, settings=settings, status="done", values=values)])
        address = write_page(store, study, [6, 7], {number: out / "front" / f"{number}.toml" for number in (6, 7)})
    page = open_page(address.as_uri(), 390)
    front = page.locator("#plots figure:first-of-type")
    assert front.locator("circle").count() == 3  # two designs, and a ring round the one that is picked
    assert front.get_by_text("none", exact=True).count() == 1  # at 0.04
    x, y = (float(front.locator("circle").nth(1).get_attribute(f"c{axis}")) for axis in "xy")
    front.locator("svg").first.click(position={"x": x, "y": y})
    page.wait_for_function("() => window.twintip.setting.picked === 7")
    assert page.get_attribute("#design a", "href") == "front/7.toml"
    assert "'fruit.bruise_limit_MPa=[0.06,0.1,0.2,0.3]'" in page.inner_text("#design code")
    assert page.locator("#plots h3").all_inner_texts()[-2:] == ["Over press.travel_mm", "Over print.process"]
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    assert page.complaints == []
    assert grave_findings(page) == []
    assert validator_findings(address) == ""
