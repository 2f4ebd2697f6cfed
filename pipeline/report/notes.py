"""Notes for the user, in addition to the verdicts. Most notes recommend an action and give its reason as a number."""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from pipeline.errors.budget import Budgets
from pipeline.reading.analysis import ReadingAccuracy
from pipeline.reading.pressed_sensor import PressedSensor
from pipeline.reading.reading_over_time import decrease_at_twice_the_time
from pipeline.response.scene_press import mean_tip_pressure
from pipeline.result import SensorResult
from pipeline.springs.fitted_springs import height_difference_down
from sensor.design.fruit import USUAL_MODULI, Fruit
from sensor.design.fruits import FRUITS
from sensor.design.parameters import Design
from sensor.quantity import COVERAGE
from sensor.theory.free_fruit import table_indentation_fraction
from sensor.theory.hertz import equivalent_radius
from sensor.theory.relaxation import ASSUMED_RELAXATION
from sensor.words import rounded

# Sorting values [%] of notes that do not state a single change of a number
_ALWAYS_FIRST = math.inf
_ALWAYS_LAST = 0.0
_NOISE_RANK = 10.0  # a judgement: the note on noise is sorted like a change in E of 10 %
_FLESH_RANK = 5.0  # change in E [%] if the flesh is 30 % firmer at the stone


class Note(NamedTuple):
    """A sentence, and the largest relative change [%] that its subject causes in a reading or another number.

    Notes are sorted by this change, the largest first. The change is infinite for a note that must come first, and 0
    for a note that must come last.
    """

    percent: float
    text: str


def notes(result: SensorResult) -> list[str]:
    """Return the notes on a result as sentences, the notes on the largest changes of a number first.

    Sentences on an unusual modulus and on files that were not written come before all others. The last sentence states
    the method that solved the response. A design without `[reading]` gets notes on the force ratio. Any other design
    gets notes on its readings.
    """
    info = result.press.table.info
    main_notes = _ratio_notes(result) if result.readings is None else _reading_notes(result.pressed, result.readings)
    all_notes = [
        *_advice_notes(result.errors.budgets),
        *_given_springs_note(result),
        *_layers_note(result),
        _relaxation_note(result),
        *_skin_note(result),
        *_weight_note(result),
        *_support_note(result),
        *main_notes,
    ]
    all_notes.sort(key=lambda note: note.percent, reverse=True)
    texts = [note.text for note in all_notes]
    return [*_unusual_moduli(result.design), *result.left_out, *texts, f"Response: {info.method}; {info.status}."]


def _unusual_moduli(design: Design) -> list[str]:
    """Return a sentence that asks the user to check the unit of the first modulus that is unusual for fruit.

    The list is empty if all moduli of the design are usual.
    """
    moduli = [("fruit.E_max_MPa", design.fruit.E_max_MPa), *(("fruit.E_MPa", E) for E in design.fruit.E_MPa)]
    usual = f"fruit mostly have {USUAL_MODULI.at_least:g} to {USUAL_MODULI.at_most:g} MPa"
    unusual = [f"Check the unit of {key} = {E:g}: {usual}." for key, E in moduli if not USUAL_MODULI.hold(E)]
    return unusual[:1]


def _advice_notes(budgets: Budgets) -> Iterator[Note]:
    """Yield a note for each piece of advice on the causes of errors, with the number that the cause changes most.

    Several causes may have the same advice, and one cause may be in the budgets of several numbers. The note names only
    the largest of these changes.
    """
    note_by_advice: dict[str, Note] = {}
    for number in ("K_l", "K_h", "P_max", "NL"):
        budget = getattr(budgets, number)  # None if the number has no error budget
        causes = () if budget is None else (*budget.model, *budget.inputs)
        for cause in causes:
            if not cause.advice:
                continue
            percent = 100.0 * abs(cause.size)
            earlier_note = note_by_advice.get(cause.advice)
            if earlier_note is None or percent > earlier_note.percent:
                text = f"{cause.advice}: {cause.reason} moves {number} by {rounded(percent, 2):g} %."
                note_by_advice[cause.advice] = Note(percent, text)
    yield from note_by_advice.values()


def _given_springs_note(result: SensorResult) -> Iterator[Note]:
    """Yield the note on the given springs, only for a layout without a housing."""
    if not result.design.tips.tip_layout.has_housing:
        K_l, K_h = (1e3 * K for K in result.springs.stiffnesses.stiffnesses)  # N/mm to N/m
        yield Note(
            _ALWAYS_FIRST,
            f"Calibrate what you build: a line of tips has no housing, and {K_l:.5g} and {K_h:.5g} N/m are taken as "
            "given.",
        )


def _layers_note(result: SensorResult) -> Iterator[Note]:
    """Yield the note on the depth of the leaves as printed, if their depth is not a whole number of layers.

    The stiffness of a spring is proportional to the depth of its leaves.
    """
    springs = result.springs
    if springs.housing is None:
        return
    depth = springs.housing.depth
    printed_depth = springs.process.printed_depth_mm(depth)
    if printed_depth != depth:
        percent = 100.0 * (printed_depth / depth - 1.0)
        yield Note(
            abs(percent),
            f"Calibrate, or choose another layer height: layers of {springs.process.layer_mm:g} mm make the leaves "
            f"{printed_depth:g} mm deep, not {depth:g}, which moves K_l and K_h by {percent:+.2g} %.",
        )


def _ratio_notes(result: SensorResult) -> Iterator[Note]:
    """Yield the notes on a sensor that measures a force ratio, as a design without `[reading]` does.

    The first note is yielded only if the design has no bruise limit. This note states the mean pressure on the skin,
    because no verdict judges a pressure without a limit. The second note states the fruit stiffness divided by the
    modulus, K_m / E, for which the targets hold.
    """
    design = result.design
    if design.fruit.bruise_limit_MPa is None:
        pressure = mean_tip_pressure(design, result.press)
        yield Note(
            _ALWAYS_FIRST,
            f"Bruising was not checked: set fruit.bruise_limit_MPa. The mean pressure reaches {pressure:.2g} MPa.",
        )
    yield Note(
        _ALWAYS_LAST,
        f"Size the springs again for another fruit or other tips: these targets hold for K_m/E = "
        f"{result.contact.K_m_over_E():.5g} mm.",
    )


def _noise_note(readings: ReadingAccuracy) -> Note:
    """Return the note on the largest noise of the forces at which the uncertainty of E is within its limit.

    If the uncertainty exceeds its limit even without noise, the note states this instead.
    """
    worst = readings.worst_uncertainty
    percent = 100.0 * COVERAGE * worst.uncertainty_limit  # half width of the interval that holds 95 % of readings
    noise = worst.sources.noise_to_reach(worst.uncertainty_limit)
    if noise is None:
        text = f"even without noise the uncertainty of E is above its limit, {percent:.3g} % (95 %)."
        return Note(_NOISE_RANK, f"Calibrate better or narrow [reading]: {text}")
    return Note(
        _NOISE_RANK,
        f"Keep the noise of each force below {noise:.2g} % of full scale: there the uncertainty of E reaches its "
        f"limit, {percent:.3g} % (95 %).",
    )


def _reading_notes(sensor: PressedSensor, readings: ReadingAccuracy) -> Iterator[Note]:
    """Yield the notes on a sensor that reads whole presses: the allowed noise, and assumptions that affect E."""
    if readings.moduli:
        yield _noise_note(readings)
    uneven = readings.uneven
    if uneven is not None:
        # `COVERAGE` expands a standard uncertainty to the half width of the interval that holds 95 % of readings.
        one_press = COVERAGE * uneven.one_press_percent
        mean_of_presses = COVERAGE * uneven.presses_percent
        yield Note(
            one_press,
            f"Press {uneven.presses:g} places of a fruit: uneven skin and flesh move E by {one_press:.2g} % in one "
            f"press, by {mean_of_presses:.2g} % in their mean (95 %).",
        )
    yield from _flesh_notes(sensor.design, readings)
    yield from _duration_note(sensor)


def _flesh_notes(design: Design, readings: ReadingAccuracy) -> Iterator[Note]:
    """Yield the notes on properties of the flesh that a reading assumes: layers, material law and Poisson's ratio.

    The note on layers is only for domes, and the note on the law only if the laws differ.
    """
    fruit = design.fruit
    if design.tips.dome_radius_mm is not None:
        yield Note(
            _FLESH_RANK,
            "Scale the unit on fruit of known firmness: flesh 30 % firmer at the stone moves E by some 5 %, a skin "
            "that sticks by 3 %.",
        )
    if readings.flesh > 0.0:  # relative change in E between two laws of the flesh [1]
        percent = 100.0 * readings.flesh
        yield Note(
            percent,
            f"Allow {percent:.2g} % if you compare E with other instruments, because laws of the flesh differ by it.",
        )
    yield _poisson_note(fruit)


def _poisson_note(fruit: Fruit) -> Note:
    """Return the note on the change of E [%] within the spread of Poisson's ratio."""
    # E is proportional to 1 - nu^2. If nu changes by d nu, the relative change of E is 2 nu d nu / (1 - nu^2).
    percent = 100.0 * 2.0 * fruit.poisson * fruit.poisson_spread / (1.0 - fruit.poisson**2)
    return Note(
        percent,
        f"Set fruit.poisson if it is known: E assumes {fruit.poisson:g}, and within {fruit.poisson_spread:g} of it "
        f"E moves by {percent:.2g} %.",
    )


def _duration_note(sensor: PressedSensor) -> Iterator[Note]:
    """Yield the note on the duration of a press, because relaxation lowers E in a longer press.

    Nothing is yielded if presses of the design cannot be solved over time, or if no modulus can be read from them.
    """
    decrease = decrease_at_twice_the_time(sensor)
    if decrease is not None:
        yield Note(
            100.0 * decrease,
            f"Press always equally fast: twice the time of a press may lower E by {100.0 * decrease:.2g} %.",
        )


def _relaxation_note(result: SensorResult) -> Note:
    """Return the note on the decrease of readings while the flesh relaxes.

    If the design states no relaxation, the decrease is estimated from published data.
    """
    over_time = result.over_time
    if over_time is None:
        return _assumed_relaxation_note(result)
    # apparent modulus at the time of the reading, divided by the instantaneous modulus
    apparent_fractions = over_time.apparent[:, over_time.at] / over_time.E
    return Note(
        _ALWAYS_LAST,
        f"Read by `pipeline read`, which corrects for relaxation: {over_time.t[over_time.at]:.3g} s after touch E "
        f"has fallen to {apparent_fractions.min():.3g} to {apparent_fractions.max():.3g} times its first value.",
    )


def _assumed_relaxation_note(result: SensorResult) -> Note:
    """Return the note for a design that states no relaxation, with the decrease of the force ratio P at full travel.

    The fraction of the force that remains comes from published data on the fruit of the design. If the design names no
    fruit, the data are for an orange.
    """
    curve = result.press.curve
    name = result.design.fruit.name
    if name is None:
        fruit, remaining = "orange", ASSUMED_RELAXATION.left
    else:
        fruit, remaining = name, FRUITS[name].relaxes_to
    article = "an" if fruit[0] in "aeiou" else "a"
    E = np.array(result.design.fruit.E_MPa)
    # Flesh that has relaxed to this fraction presses like elastic flesh whose modulus is the same fraction of E.
    P_at_full_travel = curve.P[:, -1]
    P_before, P_after = np.interp([E, remaining * E], curve.E, P_at_full_travel)
    change = 100.0 * (P_after / P_before - 1.0)
    return Note(
        100.0 * (1.0 - remaining),
        f"Read soon after the touch or set fruit.relaxation: {article} {fruit} relaxes to {100.0 * remaining:g} %, so "
        f"P moves by {change.max():.2g} to {change.min():.2g} %.",
    )


def _skin_note(result: SensorResult) -> Iterator[Note]:
    """Yield the note on the increase in fruit stiffness [%] due to a skin, for the softest and the firmest fruit.

    Nothing is yielded for a fruit without a skin.
    """
    if result.contact.skin is None:
        return
    stiffness_without_skin = result.contact.K_m_over_E()  # stiffness of the fruit under one tip, divided by E [mm]
    increases = []
    texts = []
    for E in (min(result.design.fruit.E_MPa), result.design.fruit.E_max_MPa):
        percent = 100.0 * (result.contact.at(E).K_m_over_E() / stiffness_without_skin - 1.0)
        increases.append(percent)
        texts.append(f"{percent:+.3g} % at {E:g} MPa")
    yield Note(
        max(increases),
        f"Measure skin_mm and skin_E_MPa well: the skin moves the fruit stiffness by {' and '.join(texts)}.",
    )


def _weight_note(result: SensorResult) -> Iterator[Note]:
    """Yield the note on the height difference of the tips due to weight, for a sensor that reads whole presses.

    A small difference cancels, but all tips must touch early in the travel. Nothing is yielded without a housing.
    """
    if result.springs.housing is None or result.readings is None:
        return
    difference = height_difference_down(result.springs)
    press = result.design.press
    if difference <= press.small_step_mm:
        yield Note(
            _ALWAYS_LAST,
            f"Tare in any attitude: pointing down, the tips differ by {difference:.2g} mm in height, which cancels in "
            "a press that is read whole.",
        )
    else:
        yield Note(
            100.0 * difference / press.travel_mm,
            f"Hold the sensor in the attitude of its design (press.attitude = {press.attitude}): from the side to "
            f"pointing down, the tips shift by {difference:.2g} mm in height, of a travel of {press.travel_mm:g} mm.",
        )


def _support_note(result: SensorResult) -> Iterator[Note]:
    """Yield the note on the support of a whole fruit, which flattens on a table; the solution neglects this.

    In the solution, the fruit is held at its base. The note states the flattening as a percentage of the travel, for
    the firmest fruit. Nothing is yielded for a piece of fruit, which cannot roll.
    """
    fruit = result.design.fruit
    if fruit.can_roll:
        at_largest_E = result.press.at_largest_E
        # F has the shape (moduli, travels, tips); the last travel is the full one. The force is the sum over all tips.
        force = float(at_largest_E.F[-1, -1].sum())
        travel = result.design.press.travel_mm
        radius = equivalent_radius(*fruit.radii_mm)
        percent = 100.0 * table_indentation_fraction(force, travel, float(at_largest_E.E[-1]), fruit.poisson, radius)
        yield Note(
            percent,
            f"Support the fruit at its base: a flat table gives {percent:.2g} % of the travel.",
        )
