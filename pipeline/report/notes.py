"""What a user must know beside the verdicts, each a sentence with its number and what to do."""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from pipeline.reading.analysis import Readings
from pipeline.response.scene_press import mean_tip_pressure
from pipeline.result import SensorResult
from pipeline.springs.fitted_springs import weight_sag
from sensor.design.fruit import USUAL_MODULI
from sensor.design.parameters import Design
from sensor.quantity import COVERAGE
from sensor.theory.free_fruit import roll, table_share
from sensor.theory.hertz import equivalent_radius
from sensor.theory.soft_tissue import FLESH_LAWS, deepest_solved, large_strain_factor

ORANGE = 0.42  # what is at last left of a force on Tarocco oranges: Moresi et al. (2012), doi:10.1007/s11947-011-0528-4
_ALWAYS_FIRST = math.inf


class Note(NamedTuple):
    """A sentence, and by how much its matter may move what is read [%]; infinite where it matters before any number."""

    percent: float
    text: str


def notes(result: SensorResult) -> list[str]:
    """Return the notes of a result, closed forms of its numbers only, those that move a reading most first."""
    info = result.press.table.info
    judged = _of_the_scene(result) if result.readings is None else _of_the_reading(result.design, result.readings)
    found = [
        _housing(result),
        _relaxation(result),
        *_skin(result),
        *_weight(result),
        *_free_fruit(result),
        *judged,
    ]
    found.sort(key=lambda note: note.percent, reverse=True)
    told = [note.text for note in found]
    return [*_unusual(result.design), *result.left_out, *told, f"Response: {info.method}; {info.status}."]


def _unusual(design: Design) -> list[str]:
    """Return a note on the first modulus of a design that fruit seldom have; none where all are usual."""
    moduli = [("fruit.E_max_MPa", design.fruit.E_max_MPa), *(("fruit.E_MPa", E) for E in design.fruit.E_MPa)]
    usual = f"fruit mostly have {USUAL_MODULI.at_least:g} to {USUAL_MODULI.at_most:g} MPa"
    unusual = [f"Check the unit of {key} = {E:g}: {usual}." for key, E in moduli if not USUAL_MODULI.hold(E)]
    return unusual[:1]


def _housing(result: SensorResult) -> Note:
    """Return the note on calibrating a print, or the one on a line of tips, which has no housing."""
    if result.design.tips.tip_layout.has_housing:
        process = result.springs.process
        # A leaf's stiffness is proportional to the third power of its thickness.
        moved_l, moved_h = (100.0 * (3.0 * process.accuracy_mm / leaf) for leaf in process.leaf_thicknesses_mm)
        return Note(
            max(moved_l, moved_h),
            f"Calibrate each printed unit: leaves {process.accuracy_mm:g} mm off move K_l by {moved_l:.0f} % "
            f"and K_h by {moved_h:.0f} %.",
        )
    springs = result.springs.stiffnesses
    K_l, K_h = (1e3 * K for K in springs.stiffnesses)
    return Note(
        _ALWAYS_FIRST,
        f"Calibrate what you build: a line of tips has no housing, and {K_l:.5g} and {K_h:.5g} N/m are taken as given.",
    )


def _of_the_scene(result: SensorResult) -> Iterator[Note]:
    """Yield the notes on a force ratio: depth and large strain, pressure on the skin, the fruit of the targets."""
    design = result.design
    yield _large_strain(design, design.press.travel_mm / design.tips.side_mm)
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


def _large_strain(design: Design, depth: float) -> Note:
    """Return the note on large strain of the flesh under one tip at a depth [tip sides]."""
    if not design.tips.tip_shape.has_flat_face or depth > deepest_solved():
        return Note(
            0.0,
            f"Check the deepest press on a body of known modulus: large strain at {depth:.2g} tip widths is left out.",
        )
    factors = [float(large_strain_factor(depth, design.fruit.poisson, law)) for law in FLESH_LAWS]
    changes = [100.0 * (factor - 1.0) for factor in factors]
    return Note(
        max(map(abs, changes)),
        f"Calibrate at {depth:.2g} tip widths of depth: large strain moves the force by {changes[0]:+.2g} % "
        f"({min(changes):+.2g} to {max(changes):+.2g} % by the law of the flesh).",
    )


def _noise(readings: Readings) -> Note:
    """Return the note on the noise at which the uncertainty reaches its limit in the design."""
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


def _of_the_reading(design: Design, readings: Readings) -> Iterator[Note]:
    """Yield the notes on readings: the noise that they bear, and the assumptions that move them."""
    fruit = design.fruit
    # d ln(1 - nu^2) by the spread of nu
    moved = 100.0 * 2.0 * fruit.poisson * fruit.poisson_spread / (1.0 - fruit.poisson**2)
    if readings.moduli:
        yield _noise(readings)
    if readings.heights > 0.0:
        yield Note(
            5.0 * readings.heights,
            f"Press smooth skin: a bump of 0.05 mm under one kind of tips moves E by {5.0 * readings.heights:.2g} %.",
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
            f"Allow {percent:.2g} % where you compare E with other instruments: so much do laws of the flesh differ.",
        )
    yield Note(
        moved,
        f"Set fruit.poisson where it is known: E takes {fruit.poisson:g}, and within {fruit.poisson_spread:g} of it "
        f"E moves by {moved:.2g} %.",
    )
    yield Note(4.0, "Press always equally fast: twice the time of a press lowers the E of flesh by some 4 %.")


def _relaxation(result: SensorResult) -> Note:
    """Return the note on readings that fall as the flesh relaxes; by published flesh where the design does not say."""
    over_time = result.over_time
    if over_time is None:
        curve = result.press.curve
        E = np.array(result.design.fruit.E_MPa)
        P = np.interp([E, ORANGE * E], curve.E, curve.P[:, -1])
        change = 100.0 * (P[1] / P[0] - 1.0)
        return Note(
            100.0 * (1.0 - ORANGE),
            f"Read soon after the touch or set fruit.relaxation: an orange relaxes to {100.0 * ORANGE:g} %, so "
            f"P moves by {change.max():.2g} to {change.min():.2g} %.",
        )
    fallen = over_time.apparent[:, over_time.at] / over_time.E
    return Note(
        0.0,
        f"Read by `pipeline read`, which corrects for relaxation: {over_time.t[over_time.at]:.3g} s after touch E "
        f"has fallen to {fallen.min():.3g} to {fallen.max():.3g} times its first value.",
    )


def _skin(result: SensorResult) -> Iterator[Note]:
    """Yield the note on a skin: the gain in K_m at the least and the largest modulus of the flesh; none without."""
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
    """Yield the note on the weight of the moving parts, which sets the tips off level; none where nothing is made."""
    sags = [sag.value for sag in weight_sag(result.springs, "down")]
    if not sags:
        return
    apart = max(sags) - min(sags)
    press = result.design.press
    off_level = f"pointing down, the tips hang {apart:.2g} mm off level"
    if result.readings is None:
        percent = 100.0 * apart / press.travel_mm
        yield Note(percent, f"Zero the forces in the attitude of the press ({press.attitude}): {off_level}.")
    else:
        yield Note(0.0, f"Tare in any attitude: {off_level}, which a press that is read whole does not see.")


def _free_fruit(result: SensorResult) -> Iterator[Note]:
    """Yield the note on a whole fruit, which is solved as held at its base: what changes where it lies on a table."""
    fruit = result.design.fruit
    if not fruit.can_roll or fruit.radius_mm is None:
        return
    at_largest_E = result.press.at_largest_E
    E = float(at_largest_E.E[-1])
    forces = at_largest_E.F[-1, -1]
    travel = result.design.press.travel_mm
    on_table = equivalent_radius(*fruit.radii_mm)
    by_table = table_share(float(forces.sum()), travel, E, fruit.poisson, on_table)
    contact = result.contact.at(E)
    # Spring and flesh in series under each tip alone, without the crosstalk, which moves all tips alike [mm/N].
    compliance_under_tip = np.diag(result.springs.C) + (np.diag(contact.S) - contact.crosstalk) / E
    stiffness_under_tip = (1.0 / compliance_under_tip).tolist()
    rolled = roll(forces.tolist(), result.design.tips.centres_mm, stiffness_under_tip, fruit.radius_mm)
    rolls = f"rolls by {rolled.angle_deg:.2g} deg" if rolled.steady else "rolls away under the tips"
    yield Note(
        100.0 * by_table,
        f"Hold the fruit: free on a table it gives {100.0 * by_table:.2g} % of the travel there, and {rolls} unless "
        f"friction of at least {rolled.friction:.2g} holds it.",
    )
