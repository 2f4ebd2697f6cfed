"""What the sensor reads in the scene that was asked for, solved once for everything that judges or draws it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cad.design.parameters import Design
from solve.contact.linear_response import SensorResponse, travels
from solve.contact.response import scene_response
from solve.contact.scene import Scene
from solve.fruit.compliance import FruitCompliance

Floats = NDArray[np.float64]

TRAVELS = 12
_SCAN = 20  # moduli, from the least asked for to E_max, at which P must rise


@dataclass(frozen=True, kw_only=True)
class ScenePress:
    """The presses of one set of springs on the fruit of a design.

    `table` is over travel at each modulus shown, `scan` over 20 moduli up to E_max at full travel, `hardest` at the
    largest modulus of all and full travel.
    """

    table: SensorResponse
    scan: SensorResponse
    hardest: SensorResponse


def scene_of(design: Design) -> Scene:
    """Return the scene of contact of a design."""
    return Scene(fruit=design.fruit, tips=design.tips, press=design.press)


def press_scene(design: Design, contact: FruitCompliance, C: Floats) -> ScenePress:
    """Return the presses of springs with compliance C, shape (tips, tips) [mm/N]; raises as `_pressed`."""
    return ScenePress(
        table=press_table(design, contact, C),
        scan=press_scan(design, contact, C),
        hardest=_pressed(design, contact, C, [design.largest_E_MPa], 1),
    )


def press_table(design: Design, contact: FruitCompliance, C: Floats) -> SensorResponse:
    """Return the response over 12 travels at each modulus shown; C (tips, tips) [mm/N]."""
    return _pressed(design, contact, C, design.fruit.E_MPa, TRAVELS)


def press_scan(design: Design, contact: FruitCompliance, C: Floats) -> SensorResponse:
    """Return the response at full travel over 20 moduli up to E_max; C (tips, tips) [mm/N]."""
    fruit = design.fruit
    least = min(min(fruit.E_MPa), 0.5 * fruit.E_max_MPa)
    return _pressed(design, contact, C, np.linspace(least, fruit.E_max_MPa, _SCAN), 1)


def _pressed(
    design: Design, contact: FruitCompliance, C: Floats, moduli: Sequence[float] | Floats, count: int
) -> SensorResponse:
    """Press; raises InputError where the scene is too steep or outside the domain of contact, SolveError."""
    return scene_response(scene_of(design), contact, C, moduli, travels(design.press.travel_mm, count))


def spring_shares(contact: FruitCompliance, C: Floats, E: float) -> Floats:
    """Return by how much of a relative error of its spring the force of each tip is off at modulus E [MPa], (tips,)."""
    own = np.diag(C)
    shares: Floats = own / (own + (np.diag(contact.S) - contact.crosstalk) / E)
    return shares


def mean_tip_pressure(design: Design, press: ScenePress) -> float:
    """Return the largest force over the face of its tip at the largest modulus and full travel [MPa]."""
    return float(press.hardest.F[-1, -1].max()) / design.tips.face_mm2
