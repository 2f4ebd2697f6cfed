"""Notes for the user beside the verdicts: sentences with a number and an action."""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from pipeline.errors.budget import Budgets
from pipeline.reading.analysis import ReadingAccuracy
from pipeline.reading.over_time import fall_by_twice_the_time
from pipeline.reading.pressed_sensor import PressedSensor
from pipeline.response.scene_press import mean_tip_pressure
from pipeline.result import SensorResult
from pipeline.springs.fitted_springs import weight_sag
from sensor.design.fruit import USUAL_MODULI
from sensor.design.fruits import FRUITS
from sensor.design.parameters import Design
from sensor.quantity import COVERAGE
from sensor.theory.free_fruit import table_share
from sensor.theory.hertz import equivalent_radius
from sensor.theory.relaxation import MAY_RELAX
from sensor.words import rounded

_ALWAYS_FIRST = math.inf


class Note(NamedTuple):
    """A sentence, and the change of the reading by its subject [%]; infinite if it matters before any number."""

    percent: float
    text: str


def notes(result: SensorResult) -> list[str]:
    """Return the notes of a result, the largest change of its numbers or readings first."""
    info = result.press.table.info
    judged = _of_the_scene(result) if result.readings is None else _of_the_reading(result.pressed, result.readings)
    found = [
        *_advice(result.errors.budgets),
        *_given_springs(result),
        _relaxation(result),
        *_skin(result),
        *_weight(result),
        *_table(result),
        *judged,
    ]
    found.sort(key=lambda note: note.percent, reverse=True)
    told = [note.text for note in found]
    return [*_unusual(result.design), *result.left_out, *told, f"Response: {info.method}; {info.status}."]


def _unusual(design: Design) -> list[str]:
    """Return a note on the first unusual modulus of a design; empty if all are usual."""
    moduli = [("fruit.E_max_MPa", design.fruit.E_max_MPa), *(("fruit.E_MPa", E) for E in design.fruit.E_MPa)]
    usual = f"fruit mostly have {USUAL_MODULI.at_least:g} to {USUAL_MODULI.at_most:g} MPa"
    unusual = [f"Check the unit of {key} = {E:g}: {usual}." for key, E in moduli if not USUAL_MODULI.hold(E)]
    return unusual[:1]


def _advice(budgets: Budgets) -> Iterator[Note]:
    """Yield each advice on causes of error once, with the cause and the number that it changes most."""
    largest: dict[str, Note] = {}
    for number in ("K_l", "K_h", "P_max", "NL"):
        budget = getattr(budgets, number)
        for part in () if budget is None else (*budget.model, *budget.inputs):
            percent = 100.0 * abs(part.size)
            if part.advice and (part.advice not in largest or percent > largest[part.advice].percent):
                text = f"{part.advice}: {part.reason} moves {number} by {rounded(percent, 2):g} %."
                largest[part.advice] = Note(percent, text)
    yield from largest.values()


def _given_springs(result: SensorResult) -> Iterator[Note]:
    """Yield the note on a line of tips, which has no housing; none for other tips."""
    if not result.design.tips.tip_layout.has_housing:
        K_l, K_h = (1e3 * K for K in result.springs.stiffnesses.stiffnesses)
        yield Note(
            _ALWAYS_FIRST,
            f"Calibrate what you build: a line of tips has no housing, and {K_l:.5g} and {K_h:.5g} N/m are taken as "
            "given.",
        )


def _of_the_scene(result: SensorResult) -> Iterator[Note]:
    """Yield the notes on a force ratio: the pressure on the skin, and the fruit of the targets."""
    design = result.design
    if design.fruit.bruise_limit_MPa is None:
        pressure = mean_tip_pressure(design, result.press)
        yield Note(
            _ALWAYS_FIRST,
            f"Set fruit.bruise_limit_MPa to have bruises judged: the mean pressure reaches {pressure:.2g} MPa.",
        )
    yield Note(
        0.0,
        f"Size the springs again for another fruit or other tips: these targets hold for K_m/E = "
        f"{result.contact.K_m_over_E():.5g} mm.",
    )


def _noise(readings: ReadingAccuracy) -> Note:
    """Return the note on the noise at which the uncertainty reaches its limit."""
    worst = readings.worst_uncertainty
    percent = 100.0 * COVERAGE * worst.uncertainty_limit
    noise = worst.sources.noise_to_reach(worst.uncertainty_limit)
    if noise is None:
        text = f"even without noise the uncertainty of E is above its limit, {percent:.3g} % (95 %)."
        return Note(10.0, f"Calibrate better or narrow [reading]: {text}")
    return Note(
        10.0,
        f"Keep the noise of each force below {noise:.2g} % of full scale: there the uncertainty of E reaches its "
        f"limit, {percent:.3g} % (95 %).",
    )


def _of_the_reading(sensor: PressedSensor, readings: ReadingAccuracy) -> Iterator[Note]:
    """Yield the notes on readings: the allowed noise, and assumptions that change them."""
    design = sensor.design
    fruit = design.fruit
    # d ln(1 - nu^2) for the spread of nu
    moved = 100.0 * 2.0 * fruit.poisson * fruit.poisson_spread / (1.0 - fruit.poisson**2)
    if readings.moduli:
        yield _noise(readings)
    uneven = readings.uneven
    if uneven is not None:
        one, several = (COVERAGE * each for each in (uneven.one_press_percent, uneven.presses_percent))
        yield Note(
            one,
            f"Press {uneven.presses:g} places of a fruit: uneven skin and flesh move E by {one:.2g} % in one press, by "
            f"{several:.2g} % in their mean (95 %).",
        )
    if design.tips.dome_radius_mm is not None:
        yield Note(
            5.0,
            "Scale the unit on fruit of known firmness: flesh 30 % firmer at the stone moves E by some 5 %, a skin "
            "that sticks by 3 %.",
        )
    if readings.flesh > 0.0:
        percent = 100.0 * readings.flesh
        yield Note(
            percent,
            f"Allow {percent:.2g} % if you compare E with other instruments, because laws of the flesh differ by it.",
        )
    yield Note(
        moved,
        f"Set fruit.poisson if it is known: E assumes {fruit.poisson:g}, and within {fruit.poisson_spread:g} of it "
        f"E moves by {moved:.2g} %.",
    )
    yield from _pace(sensor)


def _pace(sensor: PressedSensor) -> Iterator[Note]:
    """Yield the note on the duration of a press; none if no press of the design is read."""
    fall = fall_by_twice_the_time(sensor)
    if fall is not None:
        yield Note(
            100.0 * fall,
            f"Press always equally fast: twice the time of a press may lower E by {100.0 * fall:.2g} %.",
        )


def _relaxation(result: SensorResult) -> Note:
    """Return the note on readings that fall as the flesh relaxes; published data replace a missing relaxation."""
    over_time = result.over_time
    if over_time is None:
        curve = result.press.curve
        name = result.design.fruit.name
        left = MAY_RELAX.left if name is None else FRUITS[name].relaxes_to
        one = "an orange" if name is None else f"{'an' if name[0] in 'aeiou' else 'a'} {name}"
        E = np.array(result.design.fruit.E_MPa)
        P = np.interp([E, left * E], curve.E, curve.P[:, -1])
        change = 100.0 * (P[1] / P[0] - 1.0)
        return Note(
            100.0 * (1.0 - left),
            f"Read soon after the touch or set fruit.relaxation: {one} relaxes to {100.0 * left:g} %, so "
            f"P moves by {change.max():.2g} to {change.min():.2g} %.",
        )
    fallen = over_time.apparent[:, over_time.at] / over_time.E
    return Note(
        0.0,
        f"Read by `pipeline read`, which corrects for relaxation: {over_time.t[over_time.at]:.3g} s after touch E "
        f"has fallen to {fallen.min():.3g} to {fallen.max():.3g} times its first value.",
    )


def _skin(result: SensorResult) -> Iterator[Note]:
    """Yield the note on a skin: the gain in K_m at the least and the largest modulus; none without a skin."""
    if result.contact.skin is None:
        return
    bare = result.contact.K_m_over_E()
    gains = []
    for E in (min(result.design.fruit.E_MPa), result.design.fruit.E_max_MPa):
        gains.append((100.0 * (result.contact.at(E).K_m_over_E() / bare - 1.0), E))
    texts = [f"{gain:+.3g} % at {E:g} MPa" for gain, E in gains]
    yield Note(
        max(gain for gain, _ in gains),
        f"Measure skin_mm and skin_E_MPa well: the skin moves the fruit stiffness by {' and '.join(texts)}.",
    )


def _weight(result: SensorResult) -> Iterator[Note]:
    """Yield the note on the weight of the moving parts, for a sensor that reads whole presses."""
    sags = [sag.value for sag in weight_sag(result.springs, "down")]
    if sags and result.readings is not None:
        apart = max(sags) - min(sags)
        yield Note(
            0.0,
            f"Tare in any attitude: pointing down, the tips differ by {apart:.2g} mm in height, which cancels in a "
            "press that is read whole.",
        )


def _table(result: SensorResult) -> Iterator[Note]:
    """Yield the note on a whole fruit, which is solved as held at its base: the deflection on a table."""
    fruit = result.design.fruit
    if fruit.can_roll:
        at_largest_E = result.press.at_largest_E
        force = float(at_largest_E.F[-1, -1].sum())
        travel = result.design.press.travel_mm
        share = table_share(force, travel, float(at_largest_E.E[-1]), fruit.poisson, equivalent_radius(*fruit.radii_mm))
        yield Note(
            100.0 * share,
            f"Support the fruit at its base: a flat table gives {100.0 * share:.2g} % of the travel.",
        )
