"""The presses of a sensor in the scene of its design, solved once for all evaluations and plots."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sensor.arrays import Floats
from sensor.design.fruit import Fruit
from sensor.design.parameters import Design
from sensor.quantity import InputError, validation_error
from sensor.record import Record
from sensor.theory.two_spring_law import CURVE_STEPS, curve_shares
from solve.contact.linear_response import SensorResponse, travels
from solve.contact.response import scene_response
from solve.contact.scene import LateralCompliance, Scene, check_scene
from solve.contact.scene_cells import scene_footprints
from solve.fruit.compliance import FruitCompliance

TRAVELS = 12  # number of travels in the table
CURVE_TRAVELS = 6  # number of travels in the curve
LINEAR_MODULI = 72  # number of moduli in the curve if contact is linear; even, so that half of E_max is one of them
_SCAN_MODULI = 20  # number of moduli over which P must increase, from the smallest modulus of the design to E_max


@dataclass(frozen=True, kw_only=True, repr=False)
class ScenePress(Record):
    """The presses of one set of springs on the fruit of a design.

    - `table` has the moduli of the design, each at twelve travels. These presses become the response table of the
      report.
    - `scan` has 20 moduli up to E_max at full travel. The scan shows whether P increases with the modulus.
    - `at_largest_E` has only the largest modulus of the design, at full travel.
    - `curve` has moduli in equal steps up to E_max, each at six travels. The first modulus of the curve is nearly 0,
      for the softest possible fruit.
    - `tilted` has two presses at full travel, one with the tilt minus its spread and one with the tilt plus its spread.
      Their moduli are the first, the middle and the last one of the curve. It is empty if contact is linear, if the
      tilt has no spread, or if contact cannot be solved at one of the two tilts.
    """

    table: SensorResponse
    scan: SensorResponse
    at_largest_E: SensorResponse
    curve: SensorResponse
    tilted: tuple[SensorResponse, ...]
    scene: Scene

    @property
    def level(self) -> bool:
        """Return whether all tips touch at once, so that P does not depend on the travel."""
        return self.scene.touches_at_once


def scene_of(design: Design, height_offsets: Sequence[float] = (), sideways: LateralCompliance | None = None) -> Scene:
    """Return the contact scene of a design: all inputs of the tip forces except the springs and the modulus.

    `height_offsets` (tips,) [mm] are the height differences due to the sag of the springs. If they are empty, the tips
    are level. `sideways` is the lateral compliance of the tips under inclined forces, which only domes need.
    """
    return Scene(
        fruit=design.fruit,
        tips=design.tips,
        press=design.press,
        height_offset_mm=tuple(height_offsets),
        sideways=sideways,
    )


def refuse_unsolvable_scene(design: Design) -> None:
    """Raise InputError if contact in the scene of a design cannot be solved. The check itself solves nothing."""
    scene = scene_of(design)
    check_scene(scene)
    _check_skin(scene)
    if scene.is_solved_on_cells:
        scene_footprints(scene, design.press.travel_mm)  # called only because it raises InputError


def _check_skin(scene: Scene) -> None:
    """Raise InputError if the fruit in a scene has a skin on which contact cannot be solved.

    Contact on a skin can be solved only for tips with flat faces and domes, and not on a whole fruit.
    """
    thickness = scene.fruit.skin_mm
    if thickness is None:
        return
    if not scene.tips.tip_shape.is_solved_under_skin:
        bound = "left out unless tips have flat faces or are domes"
        raise validation_error("fruit.skin_mm", thickness, "mm", bound, "remove the skin, or choose other tips")
    if scene.fruit.is_whole:
        bound = "left out on a whole fruit"
        hint = "set fruit.length_mm and fruit.width_mm to the size of the piece under the tips"
        raise validation_error("fruit.skin_mm", thickness, "mm", bound, hint)


def press_scene(scene: Scene, contact: FruitCompliance, C: Floats) -> ScenePress:
    """Solve the presses that `ScenePress` describes, for tips on springs, and return them.

    `contact` is the compliance of the fruit under the tips, and `C` (tips, tips) [mm/N] is the compliance matrix of the
    springs. Raises InputError if contact in the scene cannot be solved, and SolveError if a solve does not converge.
    """
    fruit = scene.fruit
    full_travel = scene.press.travel_mm
    at_full_travel = travels(full_travel, 1)  # an array with one travel
    moduli = curve_moduli(scene)
    ends_and_middle = moduli[[0, len(moduli) // 2, -1]]  # all that NL at mid-range needs
    return ScenePress(
        table=scene_response(scene, contact, C, fruit.E_MPa, travels(full_travel, TRAVELS)),
        scan=scene_response(scene, contact, C, scan_moduli(fruit), at_full_travel),
        at_largest_E=scene_response(scene, contact, C, [fruit.largest_E_MPa], at_full_travel),
        curve=scene_response(scene, contact, C, moduli, travels(full_travel, CURVE_TRAVELS)),
        tilted=_tilted_presses(scene, contact, C, ends_and_middle),
        scene=scene,
    )


def curve_moduli(scene: Scene) -> Floats:
    """Return the moduli of the curve [MPa]: one that is almost zero, followed by equal steps up to E_max."""
    fractions = curve_shares(LINEAR_MODULI if scene.obeys_linear_law else CURVE_STEPS)
    return scene.fruit.E_max_MPa * np.array(fractions)


def scan_moduli(fruit: Fruit) -> Floats:
    """Return the `_SCAN_MODULI` moduli up to E_max [MPa] over which P must increase, in equal steps.

    The moduli begin at the smallest modulus of the design, but at most at E_max / 2, so that they cover a range.
    """
    smallest = min(min(fruit.E_MPa), 0.5 * fruit.E_max_MPa)
    return np.linspace(smallest, fruit.E_max_MPa, _SCAN_MODULI)


def _tilted_presses(scene: Scene, contact: FruitCompliance, C: Floats, moduli: Floats) -> tuple[SensorResponse, ...]:
    """Return the presses at full travel with the tilt minus its spread and with the tilt plus its spread.

    These presses show the effect of the pose on P_max and NL. Each press is solved for all `moduli` [MPa]. `contact` is
    the compliance of the fruit under the tips, and `C` (tips, tips) [mm/N] is the compliance matrix of the springs. The
    result is empty if contact is linear or the tilt has no spread. It is also empty if contact cannot be solved at one
    of the two tilts.
    """
    press = scene.press
    spread = press.tilt_spread_deg
    if scene.obeys_linear_law or spread == 0.0:
        return ()
    at_full_travel = travels(press.travel_mm, 1)  # an array with one travel
    responses = []
    try:
        for sign in (-1.0, 1.0):
            tilted = replace(scene, press=replace(press, tilt_deg=press.tilt_deg + sign * spread))
            responses.append(scene_response(tilted, contact, C, moduli, at_full_travel))
    except InputError:  # the design itself can be solved, but not at one of these tilts
        return ()
    return tuple(responses)


def spring_fractions(contact: FruitCompliance, C: Floats, E: float) -> Floats:
    """Return the fraction of the total compliance of each tip that is due to its spring [1], shape (tips,).

    Spring and fruit are in series, at the modulus `E` [MPa]. `contact` is the compliance of the fruit under the tips,
    and `C` (tips, tips) [mm/N] is the compliance matrix of the springs. The relative error of a tip's force is this
    fraction times the relative error of the stiffness of its spring.
    """
    spring_compliance = np.diag(C)
    contact_at_E = contact.at(E)  # on a fruit with a skin, the compliance times E depends on E
    # The crosstalk times the total force is a displacement that all tips share, so it is not part of the compliance of
    # one tip.
    fruit_compliance = (np.diag(contact_at_E.S) - contact_at_E.crosstalk) / E
    fractions: Floats = spring_compliance / (spring_compliance + fruit_compliance)
    return fractions


def mean_tip_pressure(design: Design, press: ScenePress) -> float:
    """Return the largest tip force divided by the area of a tip face [MPa], at the largest modulus and full travel."""
    return float(press.at_largest_E.F[-1, -1].max()) / design.tips.face_mm2
