"""The answer in words, and the rows of the verdict table with their bars."""

from collections.abc import Iterable
from dataclasses import dataclass

from cad.design.parameters import Design
from cad.design.tips import Attitude, Press, Tips
from cad.verdict import Verdict
from pipeline.report.stored import StoredReport
from pipeline.report.verdict_rule import UNREAD, bound_sense, bound_sign, fails_unread

OUTCOMES = {True: "passed", False: "failed", None: "undecided"}
_SIDEWAYS = 3.0  # tolerances that a bar shows to each side of its target
_MOST = 1.5  # limits that a bar of a limit shows
_POINTING: dict[Attitude, str] = {"down": "down", "side": "to the side", "up": "up"}
_ON_THE_PART = ("geometry.", "printable.", "sideways.", "files.", "report.")


@dataclass(frozen=True, kw_only=True)
class Answer:
    """The first thing that is said: passed, failed or undecided, a headline, the scene, and the note of the remedy."""

    outcome: str
    headline: str
    scene: str
    wrong: tuple[Verdict, ...]
    remedy: str | None


@dataclass(frozen=True, kw_only=True)
class Bar:
    """A bar of 100 units: the value, the ends of its error bar and of what passes, and the limit; cut at its ends."""

    value: float
    error: tuple[float, float]
    passing: tuple[float, float]
    limit: float
    words: str


@dataclass(frozen=True, kw_only=True)
class VerdictRow:
    """A verdict with its numbers as they are shown, its bar where it has one, and the same of the paper's springs.

    `more` says why it failed where its value does not.
    """

    verdict: Verdict
    outcome: str
    more: str
    value: str
    error: str
    limit: str
    tolerance: str
    bar: Bar | None
    paper: str
    paper_outcome: str


def answer_of(report: StoredReport) -> Answer:
    """Return the answer: what failed first, then what is undecided, and what would make it pass."""
    wrong = tuple(v for outcome in (False, None) for v in report.verdicts if v.passed is outcome)
    failed = sum(verdict.passed is False for verdict in wrong)
    count, name = len(report.verdicts), report.design.name
    if failed:
        outcome, headline = "failed", f"No: {name} fails {failed} of {count} verdicts in the scene asked for."
    elif wrong:
        headline = f"Not decided: {len(wrong)} of {count} verdicts of {name} lie within their own error bars."
        outcome = "undecided"
    else:
        outcome, headline = "passed", f"Yes: {name} passes all {count} verdicts in the scene asked for."
    return Answer(outcome=outcome, headline=headline, scene=_scene(report), wrong=wrong, remedy=report.remedy)


def _scene(report: StoredReport) -> str:
    """Return what was asked for: tips, fruit and press."""
    design = report.design
    fruit, tips, press = design.fruit, design.tips, design.press
    size = f"{fruit.length_mm:g} x {fruit.width_mm:g} x {fruit.depth_mm:g} mm"
    round_ = "" if fruit.radius_mm is None else f" of {fruit.radius_mm:g} mm radius"
    across = "" if fruit.radius_across_mm is None else f", {fruit.radius_across_mm:g} mm across the tips"
    return (
        f"{len(report.tips)} tips ({tips.layout}, {tips.shape}, {tips.side_mm:g} mm, {tips.spacing_mm:g} mm "
        f"apart{_more_of_tips(tips)}), pressed {press.travel_mm:g} mm {_pose(design)} into a {fruit.shape}{round_}"
        f"{across}, {size}, of {min(fruit.E_MPa):g} to {fruit.E_max_MPa:g} MPa; made by {design.print.process}."
    )


def _more_of_tips(tips: Tips) -> str:
    """Return in words what tips have beyond layout, shape and size, as far as it is not the default."""
    plain = Tips()
    said = {
        f"order {tips.order}": tips.order is not None,
        f"outer tips {tips.outer_mm or 0.0:g} mm ahead": tips.outer_mm is not None,
        f"dome radius {tips.dome_radius_mm or 0.0:g} mm": tips.dome_radius_mm is not None,
        f"half angle {tips.half_angle_deg or 0.0:g} deg": tips.half_angle_deg is not None,
        f"point of radius {tips.blunt_mm or 0.0:g} mm": tips.blunt_mm is not None,
        f"edges rounded by {tips.fillet_mm:g} mm": tips.fillet_mm != plain.fillet_mm,
        f"{tips.offset_mm:g} mm off the apex": tips.offset_mm != plain.offset_mm,
        f"socket {tips.socket}": tips.socket != plain.socket,
    }
    return "".join(f", {words}" for words, holds in said.items() if holds)


def _pose(design: Design) -> str:
    """Return in words how the sensor is held: the poses of a reading, or tilt and roll of the press."""
    press, plain, reading = design.press, Press(), design.reading
    said = [f"at a tilt of {press.tilt_deg:g} degrees"]
    if reading is not None:
        said = [
            f"at tilts up to {reading.tilt_deg:g} degrees in any direction, up to {reading.off_centre_mm:g} mm off "
            f"centre, on radii that differ by up to {100.0 * reading.radius_spread:g} %"
        ]
    if press.roll_deg != plain.roll_deg:
        said.append(f"rolled by {press.roll_deg:g} degrees")
    if press.attitude != plain.attitude:
        said.append(f"tips pointing {_POINTING[press.attitude]}")
    if press.strain != plain.strain:
        said.append("at large strain")
    return ", ".join(said)


def verdict_rows(report: StoredReport) -> tuple[tuple[VerdictRow, ...], tuple[VerdictRow, ...]]:
    """Return the rows on targets and readings, and those on the part."""
    paper = {} if report.paper is None else {verdict.name: verdict for verdict in report.paper.verdicts}
    rows = [_row(verdict, paper.get(verdict.name)) for verdict in report.verdicts]
    on_part = [row.verdict.name.startswith(_ON_THE_PART) for row in rows]
    pairs = list(zip(rows, on_part, strict=True))
    return tuple(row for row, part in pairs if not part), tuple(row for row, part in pairs if part)


def _row(verdict: Verdict, paper: Verdict | None) -> VerdictRow:
    return VerdictRow(
        verdict=verdict,
        outcome=OUTCOMES[verdict.passed],
        more=UNREAD if fails_unread(verdict) else "",
        value=shown(verdict.value, verdict.unit),
        error=shown(verdict.error),
        limit=limit_of(verdict),
        tolerance=_tolerance(verdict),
        bar=bar_of(verdict),
        paper="" if paper is None else shown(paper.value, paper.unit),
        paper_outcome="" if paper is None else OUTCOMES[paper.passed],
    )


def limit_of(verdict: Verdict, unit: str = "") -> str:
    """Return the target or limit of a verdict with a unit, its sign before it where it bounds the value on one side."""
    return bound_sign(verdict) + shown(verdict.limit, unit)


def shown(value: float | str | None, unit: str = "") -> str:
    """Return a number with five digits and its unit, or a text; nothing for None."""
    text = "" if value is None else f"{value:.5g}" if isinstance(value, int | float) else value
    return f"{text} {unit}" if text and unit not in ("", "1") else text


def _tolerance(verdict: Verdict) -> str:
    if verdict.relative and isinstance(verdict.tolerance, int | float):
        return f"{100.0 * verdict.tolerance:.5g} %"
    return "" if verdict.tolerance == 0.0 else shown(verdict.tolerance)


def bar_of(verdict: Verdict) -> Bar | None:
    """Return the bar of a verdict on numbers: about its target with a tolerance, or from 0 to beyond its limit."""
    value, limit, tolerance = verdict.value, verdict.limit, verdict.tolerance
    if value is None or not isinstance(limit, int | float) or not isinstance(tolerance, int | float):
        return None
    width = tolerance * abs(limit) if verdict.relative else tolerance
    if width > 0.0:
        return _bar_about(verdict, value, limit, width)
    return _bar_to(verdict, value, limit) if limit > 0.0 else None


def _bar_about(verdict: Verdict, value: float, target: float, width: float) -> Bar:
    """Return the bar about a target, of which `width` to either side passes [unit of the verdict]."""
    scale, error = 50.0 / (_SIDEWAYS * width), verdict.error or 0.0
    return Bar(
        value=_cut(50.0 + scale * (value - target)),
        error=(_cut(50.0 + scale * (value - error - target)), _cut(50.0 + scale * (value + error - target))),
        passing=(50.0 - scale * width, 50.0 + scale * width),
        limit=50.0,
        words=f"{(value - target) / width:+.2g} of the tolerance from the target",
    )


def _bar_to(verdict: Verdict, value: float, limit: float) -> Bar:
    """Return the bar from 0 to beyond a limit, on whose one side or the other a value passes."""
    scale, error = 100.0 / (_MOST * limit), verdict.error or 0.0
    sense = bound_sense(verdict)
    below = (value <= limit) is (verdict.passed is not False) if sense is None else sense == "at most"
    return Bar(
        value=_cut(scale * value),
        error=(_cut(scale * (value - error)), _cut(scale * (value + error))),
        passing=(0.0, scale * limit) if below else (scale * limit, 100.0),
        limit=scale * limit,
        words=f"{value / limit:.2g} of the limit",
    )


def _cut(place: float) -> float:
    return min(100.0, max(0.0, place))


def dimension_rows(report: StoredReport) -> Iterable[tuple[str, str]]:
    """Yield the dimensions of leaves and housing [mm]: what, and how much in text."""
    for name, spring in report.springs.items():
        if spring.dimensions_mm is not None:
            yield from ((f"{name} spring, leaf {key}", f"{size:g}") for key, size in vars(spring.dimensions_mm).items())
    housing = report.housing
    if housing is None:
        return
    for key, size in vars(housing).items():
        if isinstance(size, float) and size != 0.0:
            yield key.replace("_", " "), f"{size:.5g}"
