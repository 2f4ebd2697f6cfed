"""What a user must know beside the verdicts, each a sentence with its number."""

import math
from collections.abc import Iterator

import numpy as np

from pipeline.reading.analysis import Readings
from pipeline.response.scene_press import mean_tip_pressure
from pipeline.result import SensorResult
from pipeline.springs.fitted_springs import weight_sag
from sensor.design.parameters import Design
from sensor.design.sheets import SHEETS
from sensor.theory.free_fruit import roll, table_share
from sensor.theory.hertz import equivalent_radius
from sensor.theory.soft_tissue import FLESH_LAWS, deepest_solved, large_strain_factor
from sensor.theory.strip_clamp import unbonded_loss

UNBONDED_MM = 1.0  # of the glue at each shoulder, in the bound that is told
ORANGE = 0.42  # what is at last left of a force on Tarocco oranges: Moresi et al. (2012), doi:10.1007/s11947-011-0528-4


def notes(result: SensorResult) -> list[str]:
    """Return the notes of a result, closed forms of its numbers only, the weightiest first."""
    info = result.press.table.info
    judged = _of_the_scene(result) if result.readings is None else _of_the_reading(result.design, result.readings)
    return [
        *result.left_out,
        _housing(result),
        _relaxation(result),
        *_skin(result),
        *_weight(result),
        *_free_fruit(result),
        *judged,
        f"response: {info.method}; {info.status}",
    ]


def _housing(result: SensorResult) -> str:
    """Return the note on calibrating a print, or the one on a line of tips, which has no housing."""
    if result.design.tips.tip_layout.has_housing:
        if not result.springs.leaves.is_printed:
            return _strips(result)
        process = result.springs.process
        # A leaf's stiffness is proportional to the third power of its thickness.
        moved_l, moved_h = (100.0 * (3.0 * process.accuracy_mm / leaf) for leaf in process.leaf_thicknesses_mm)
        return (
            f"calibrate each printed unit: leaves {process.accuracy_mm:g} mm off move K_l by {moved_l:.0f} % "
            f"and K_h by {moved_h:.0f} %"
        )
    return (
        "three tips in a line have no housing: no verdict is on springs or parts. The springs have exactly the "
        "stiffnesses of [springs] and are not coupled. Calibrate the sensor that you build"
    )


def _strips(result: SensorResult) -> str:
    """Return the note on strips of sheet: what they are, how well they are known, and what a bad clamp would lose."""
    springs = result.springs
    leaves = springs.leaves
    process = springs.process
    lengths = [spring.printable.length_mm for spring in springs.springs]
    sizes = [sizes for _, sizes in leaves.causes(lengths)]
    scatter = " and ".join(f"{100.0 * math.hypot(*of_spring):.2g}" for of_spring in zip(*sizes, strict=True))
    sheets = " and ".join(f"{thickness:g}" for thickness in leaves.sold_mm or ())
    lost = " and ".join(
        f"{100.0 * unbonded_loss(length, give, UNBONDED_MM):.2g}"
        for length, give in zip(lengths, leaves.gives_mm, strict=True)
    )
    weigh = "weigh them, and give print.leaf_measured_low_mm and _high_mm"
    known = f"; sheets as sold, {weigh}" if leaves.scatters[0].thickness > SHEETS[leaves.kind].weighed else ""
    return (
        f"leaves of {leaves.kind} {sheets} mm thick in {process.name}: K_l and K_h as made within {scatter} % (two "
        f"sigma){known}. Glue that misses the last {UNBONDED_MM:g} mm at each shoulder would cost {lost} % of them"
    )


def _of_the_scene(result: SensorResult) -> Iterator[str]:
    """Yield the notes on a force ratio: depth and large strain, pressure on the skin, the fruit of the targets."""
    design = result.design
    depth = design.press.travel_mm / design.tips.side_mm
    yield f"press: {depth:.2g} tip sides at most; {_large_strain(design, depth)}"
    pressure = mean_tip_pressure(design, result.press)
    yield f"bruise: mean pressure {pressure:.2g} MPa at the largest E and full travel"
    yield (
        f"the targets hold for this fruit and these tips, K_m/E = {result.contact.K_m_over_E():.5g} mm (the paper's "
        "have 1.3226 mm; its tips on a cube of 12 mm 15 % less)"
    )


def _large_strain(design: Design, depth: float) -> str:
    """Return the note on large strain of the flesh under one tip at a depth [tip sides]."""
    if not design.tips.tip_shape.has_flat_face or depth > deepest_solved():
        return f"small strain is assumed; large strain was solved for flat tips down to {deepest_solved():g} sides"
    changes = [100.0 * (large_strain_factor(depth, design.fruit.poisson, law) - 1.0) for law in FLESH_LAWS]
    return (
        f"large strain is left out: at this depth it changes the force of a tip by {changes[0]:+.2g} % "
        f"({min(changes):+.2g} to {max(changes):+.2g} % by the law of the flesh), which the error bars count; "
        "calibrate at the same depth on a body of known E"
    )


def _of_the_reading(design: Design, readings: Readings) -> Iterator[str]:
    """Yield the notes on readings: the noise that they bear, and the assumptions that move them."""
    fruit = design.fruit
    # d ln(1 - nu^2) by the spread of nu
    moved = 100.0 * 2.0 * fruit.poisson * fruit.poisson_spread / (1.0 - fruit.poisson**2)
    noise = readings.noise_percent
    loud = "even without noise it is above" if noise is None else f"noise of {noise:.2g} % of full scale brings it to"
    yield f"uncertainty of E: {loud} 10 %"
    if readings.heights > 0.0:
        yield (
            f"heights of the tips drop out of a press: 0.05 mm of contrast moves E by {5.0 * readings.heights:.2g} %"
        )
    if design.tips.dome_radius_mm is not None:
        yield (
            "left out of the bar: a skin that sticks to the domes reads E some 3 % high; flesh whose modulus rises or "
            "falls by 30 % towards the stone reads some 5 % higher or lower than at the skin"
        )
    if readings.flesh > 0.0:
        percent = 100.0 * readings.flesh
        yield f"law of the flesh: E is that of neo-Hookean flesh; by Hencky or as foam it is within {percent:.2g} %"
    yield (
        f"what is read is E / (1 - nu^2): E takes nu = {fruit.poisson:g}, which within {fruit.poisson_spread:g} moves "
        f"it by {moved:.2g} %; twice the time of a press lowers the E of flesh by some 4 %"
    )


def _relaxation(result: SensorResult) -> str:
    """Return the note on readings that fall as the flesh relaxes; by published flesh where the design does not say."""
    over_time = result.over_time
    if over_time is None:
        curve = result.press.curve
        E = np.array(result.design.fruit.E_MPa)
        P = np.interp([E, ORANGE * E], curve.E, curve.P[:, -1])
        change = 100.0 * (P[1] / P[0] - 1.0)
        return (
            f"relaxation of the flesh is not known and left out: an orange relaxes to {100.0 * ORANGE:g} %, "
            f"by which P moves by {change.max():.2g} to {change.min():.2g} % and E that is read as the flesh does; "
            "give fruit.relaxation"
        )
    fallen = over_time.apparent[:, over_time.at] / over_time.E
    return (
        f"relaxation: E is the modulus at the first instant; what is read {over_time.t[over_time.at]:.3g} s after the "
        f"touch is {fallen.min():.3g} to {fallen.max():.3g} times it, which `pipeline read` takes back"
    )


def _skin(result: SensorResult) -> Iterator[str]:
    """Yield the note on a skin: the gain in K_m at the least and the largest modulus of the flesh; none without."""
    if result.contact.skin is None:
        return
    bare = result.contact.K_m_over_E()
    gains = []
    for E in (min(result.design.fruit.E_MPa), result.design.fruit.E_max_MPa):
        gains.append(f"{100.0 * (result.contact.at(E).K_m_over_E() / bare - 1.0):+.3g} % at {E:g} MPa")
    yield f"skin: the fruit is stiffer under a tip than its flesh alone, K_m {' and '.join(gains)}"


def _weight(result: SensorResult) -> Iterator[str]:
    """Yield the note on the weight of the moving parts, which sets the tips off level; none where nothing is made."""
    sags = [sag.value for sag in weight_sag(result.springs, "down")]
    if sags:
        is_read = result.readings is not None
        then = "a press that is read whole does not see it" if is_read else "zero them in the one in which they press"
        yield (
            f"weight: with the tips down they hang {max(sags) - min(sags):.2g} mm off level; solved for the attitude "
            f"{result.design.press.attitude!r}, {then}"
        )


def _free_fruit(result: SensorResult) -> Iterator[str]:
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
    yield (
        f"a whole fruit is solved as held at its base; free on a table it gives {100.0 * by_table:.2g} % of the travel "
        f"at the table, and {rolls} unless friction of at least {rolled.friction:.2g} holds it: hold the fruit"
    )
