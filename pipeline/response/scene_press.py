"""The presses of a sensor in the scene of its design, solved once for all that evaluate or draw them."""

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

TRAVELS = 12  # travels of the table
CURVE_TRAVELS = 6  # travels of the curve
LINEAR_MODULI = 72  # moduli of the curve; an even number, so that half of E_max is one of them
_SCAN = 20  # moduli over which P must rise, from the smallest one of the design to E_max


@dataclass(frozen=True, kw_only=True, repr=False)
class ScenePress(Record):
    """The presses of one set of springs on the fruit of a design.

    `table` varies the travel at each modulus of the design, and `scan` has 20 moduli up to E_max at full travel.
    `at_largest_E` is at the largest modulus and full travel. `curve` has equal steps of the modulus up to E_max at six
    travels; its first modulus represents the softest possible fruit. `tilted` has presses at full travel with the tilt
    minus and plus its spread, at the first, middle and last modulus of the curve. It is empty if contact is linear.
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
    """Return the contact scene of a design: what the forces of the tips depend on, apart from springs and modulus.

    `height_offsets` (tips,) [mm] are the heights of the tips relative to the foremost, and `sideways` is their lateral
    compliance under inclined forces.
    """
    return Scene(
        fruit=design.fruit,
        tips=design.tips,
        press=design.press,
        height_offset_mm=tuple(height_offsets),
        sideways=sideways,
    )


def refuse_unsolvable_scene(design: Design) -> None:
    """Raise InputError if contact cannot be solved in the scene of a design, before anything is solved."""
    scene = scene_of(design)
    check_scene(scene)
    _check_skin(scene)
    if scene.on_cells:
        scene_footprints(scene, design.press.travel_mm)


def _check_skin(scene: Scene) -> None:
    """Raise InputError if the fruit has a skin under which contact cannot be solved.

    It can be solved for flat tips and domes, on a piece of a fruit.
    """
    thickness = scene.fruit.skin_mm
    if thickness is None:
        return
    if not scene.tips.tip_shape.is_solved_under_skin:
        bound = "left out unless tips have flat faces or are domes"
        raise validation_error("fruit.skin_mm", thickness, "mm", bound, "drop the skin, or take other tips")
    if scene.fruit.whole:
        bound = "left out on a whole fruit"
        hint = "give fruit.length_mm and fruit.width_mm, the piece under the tips"
        raise validation_error("fruit.skin_mm", thickness, "mm", bound, hint)


def press_scene(scene: Scene, contact: FruitCompliance, C: Floats) -> ScenePress:
    """Solve all presses of a scene on springs with the compliance matrix C, (tips, tips) [mm/N].

    `contact` is the compliance of the fruit. Raises like `scene_response`.
    """
    fruit = scene.fruit
    x = scene.press.travel_mm
    full_travel = travels(x, 1)
    moduli = curve_moduli(scene)
    ends_and_middle = moduli[[0, len(moduli) // 2, -1]]
    return ScenePress(
        table=scene_response(scene, contact, C, fruit.E_MPa, travels(x, TRAVELS)),
        scan=scene_response(scene, contact, C, scan_moduli(fruit), full_travel),
        at_largest_E=scene_response(scene, contact, C, [fruit.largest_E_MPa], full_travel),
        curve=scene_response(scene, contact, C, moduli, travels(x, CURVE_TRAVELS)),
        tilted=_tilted_presses(scene, contact, C, ends_and_middle),
        scene=scene,
    )


def curve_moduli(scene: Scene) -> Floats:
    """Return the moduli of the curve of a scene [MPa]: almost zero, then equal steps up to E_max."""
    fractions = curve_shares(LINEAR_MODULI if scene.linear else CURVE_STEPS)
    return scene.fruit.E_max_MPa * np.array(fractions)


def scan_moduli(fruit: Fruit) -> Floats:
    """Return the 20 moduli up to E_max over which P must rise [MPa]."""
    smallest = min(min(fruit.E_MPa), 0.5 * fruit.E_max_MPa)
    return np.linspace(smallest, fruit.E_max_MPa, _SCAN)


def _tilted_presses(scene: Scene, contact: FruitCompliance, C: Floats, moduli: Floats) -> tuple[SensorResponse, ...]:
    """Return the presses at full travel with the tilt minus and plus its spread.

    The result is empty if contact is linear, if the tilt has no spread, or if such a tilt is outside the domain of
    contact.
    """
    press = scene.press
    spread = press.tilt_spread_deg
    if scene.linear or spread == 0.0:
        return ()
    full_travel = travels(press.travel_mm, 1)
    responses = []
    try:
        for side in (-1.0, 1.0):
            tilted = replace(scene, press=replace(press, tilt_deg=press.tilt_deg + side * spread))
            responses.append(scene_response(tilted, contact, C, moduli, full_travel))
    except InputError:  # the design itself can be pressed; only its tilted neighbours cannot
        return ()
    return tuple(responses)


def spring_fractions(contact: FruitCompliance, C: Floats, E: float) -> Floats:
    """Return the share of the spring in the compliance of spring and fruit in series, for each tip at E [MPa] [1].

    The result has the shape (tips,). A relative error of a spring's stiffness causes the same error of the tip's force,
    times this share.
    """
    spring_compliance = np.diag(C)
    contact = contact.at(E)  # under a skin the compliance times E depends on E
    fruit_compliance = (np.diag(contact.S) - contact.crosstalk) / E
    fractions: Floats = spring_compliance / (spring_compliance + fruit_compliance)
    return fractions


def mean_tip_pressure(design: Design, press: ScenePress) -> float:
    """Return the largest force over the face of its tip at the largest modulus and full travel [MPa]."""
    return float(press.at_largest_E.F[-1, -1].max()) / design.tips.face_mm2
