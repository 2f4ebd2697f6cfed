"""What the sensor reads in the scene that was asked for, solved once for everything that judges or draws it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from cad.design.parameters import Design
from cad.quantity import Estimate, InputError
from cad.theory.two_spring_law import CURVE_STEPS, curve_shares
from pipeline.response.tip_curve import refuse_large_strain, tip_curve
from solve.contact.large_response import large_response
from solve.contact.linear_response import SensorResponse, travels
from solve.contact.response import scene_response
from solve.contact.scene import Scene, check_scene
from solve.contact.scene_cells import scene_footprints
from solve.fruit.compliance import FruitCompliance

Floats = NDArray[np.float64]

TRAVELS = 12
_SCAN = 20  # moduli, from the least asked for to E_max, at which P must rise
CURVE_TRAVELS = 6
LINEAR_MODULI = 72  # of the curve; an even number, so that half of E_max is one of them


@dataclass(frozen=True, kw_only=True)
class ScenePress:
    """The presses of one set of springs on the fruit of a design.

    `table` is over travel at each modulus shown, `scan` over 20 moduli up to E_max at full travel, `hardest` at the
    largest modulus of all and full travel. `curve` is over equal steps of the modulus up to E_max at six travels; its
    first modulus stands for the softest fruit there may be. `tilted` are the presses at full travel of the curve's
    first, middle and last modulus with the tilt off by its spread to either side, where contact is solved on cells.
    `ahead` is how far each tip stands before the foremost one [mm], none where all are level. `level` says that flat
    sharp tips touch a flat fruit all at once, so that P is one number over the travel.
    """

    table: SensorResponse
    scan: SensorResponse
    hardest: SensorResponse
    curve: SensorResponse
    tilted: tuple[SensorResponse, ...]
    ahead: tuple[float, ...]
    level: bool


def scene_of(design: Design, ahead: Sequence[float] = ()) -> Scene:
    """Return the scene of contact of a design; `ahead` is how far each tip stands before the others [mm]."""
    return Scene(fruit=design.fruit, tips=design.tips, press=design.press, height_offset_mm=tuple(ahead))


def refuse_unsolvable(design: Design) -> None:
    """Raise InputError where contact cannot be solved in the scene of a design; solves nothing."""
    scene = scene_of(design)
    check_scene(scene)
    if scene.press.strain == "large":
        refuse_large_strain(design)
    elif not scene.linear and not scene.tips.tip_shape.obeys_hertz:
        scene_footprints(scene, design.press.travel_mm)


def press_scene(design: Design, contact: FruitCompliance, C: Floats, ahead: Sequence[float] = ()) -> ScenePress:
    """Return the presses of springs with compliance C, shape (tips, tips) [mm/N]; raises as `pressed_at`.

    `ahead` is how far each tip stands before the others [mm], none where all are level.
    """
    scene = scene_of(design, ahead)
    moduli = curve_moduli(scene)
    return ScenePress(
        table=pressed_at(scene, contact, C, design.fruit.E_MPa, TRAVELS),
        scan=press_scan(design, contact, C, ahead),
        hardest=pressed_at(scene, contact, C, [design.largest_E_MPa], 1),
        curve=pressed_at(scene, contact, C, moduli, CURVE_TRAVELS),
        tilted=()
        if scene.linear or scene.press.strain == "large"
        else _tilted(scene, contact, C, moduli[[0, len(moduli) // 2, -1]]),
        ahead=scene.height_offset_mm,
        level=scene.linear and not any(scene.height_offset_mm),
    )


def curve_moduli(scene: Scene) -> Floats:
    """Return the moduli of the curve of a scene [MPa]: next to none, and equal steps up to E_max."""
    shares = curve_shares(LINEAR_MODULI if scene.linear else CURVE_STEPS)
    return scene.fruit.E_max_MPa * np.array(shares)


def press_scan(design: Design, contact: FruitCompliance, C: Floats, ahead: Sequence[float] = ()) -> SensorResponse:
    """Return the response at full travel over 20 moduli up to E_max; C (tips, tips) [mm/N]."""
    fruit = design.fruit
    least = min(min(fruit.E_MPa), 0.5 * fruit.E_max_MPa)
    moduli = np.linspace(least, fruit.E_max_MPa, _SCAN)
    return pressed_at(scene_of(design, ahead), contact, C, moduli, 1)


def _tilted(scene: Scene, contact: FruitCompliance, C: Floats, moduli: Floats) -> tuple[SensorResponse, ...]:
    """Return the presses with the tilt off by its spread to either side; none where that leaves the domain."""
    press = scene.press
    spread = press.tilt_spread_deg
    if spread == 0.0:
        return ()
    try:
        presses = [replace(press, tilt_deg=press.tilt_deg + side * spread) for side in (-1.0, 1.0)]
        return tuple(pressed_at(replace(scene, press=each), contact, C, moduli, 1) for each in presses)
    except InputError:
        return ()


def pressed_at(
    scene: Scene, contact: FruitCompliance, C: Floats, moduli: Sequence[float] | Floats, count: int
) -> SensorResponse:
    """Press; raises InputError where the scene is too steep or outside the domain of contact, SolveError."""
    x = travels(scene.press.travel_mm, count)
    if scene.press.strain == "large":
        return large_response(scene, contact, C, tip_curve(scene), (moduli, x))
    return scene_response(scene, contact, C, moduli, x)


def spring_shares(contact: FruitCompliance, C: Floats, E: float) -> Floats:
    """Return by how much of a relative error of its spring the force of each tip is off at modulus E [MPa], (tips,)."""
    own = np.diag(C)
    shares: Floats = own / (own + (np.diag(contact.S) - contact.crosstalk) / E)
    return shares


def mean_tip_pressure(design: Design, press: ScenePress) -> float:
    """Return the largest force over the face of its tip at the largest modulus and full travel [MPa]."""
    return float(press.hardest.F[-1, -1].max()) / design.tips.face_mm2


def mean_pressure_estimate(design: Design, press: ScenePress, of_springs: float = 0.0) -> Estimate:
    """Return `mean_tip_pressure` with its error [MPa]: that of the contact, and the relative one of the springs [1]."""
    of_contact = float(press.hardest.F_error[-1, -1])
    relative = of_springs + (of_contact if of_contact > 0.0 else 0.0)  # nan where no tip is on the fruit
    pressure = mean_tip_pressure(design, press)
    return Estimate(pressure, relative * pressure, "MPa")
