"""The force of one tip at large strain, solved once for each shape of tip, flesh and depth and then kept."""

from cad.design.parameters import Design
from cad.quantity import validation_error
from pipeline.storage.cache import cached
from solve.contact.large_response import check_large_strain, round_tip
from solve.contact.scene import Scene
from solve.large_strain.force_curve import ForceCurve, force_curve

REACHED = 1.0 - 1e-9


def tip_curve(scene: Scene) -> ForceCurve:
    """Return the curve of a scene's tips down to its travel, where a tip stands on a spring that does not give.

    Raises InputError for a scene that large strain is not solved for, or where no equilibrium was found so deep.
    """
    law, tip = check_large_strain(scene), round_tip(scene)
    travel, side = scene.press.travel_mm, scene.tips.side_mm
    inputs = {"tip": tip, "law": law, "deepest": travel / side}
    curve = cached("large-strain", inputs, lambda: force_curve(tip, law, travel / side), ForceCurve)
    if curve.reached < REACHED * travel / side:
        bound = (
            f"at most {curve.reached * side:.3g} mm = {curve.reached:.3g} tip sides for press.strain = 'large', the "
            "deepest equilibrium that was found"
        )
        raise validation_error(
            "press.travel_mm", travel, "mm", bound, "press less deep, take wider tips or press.strain = 'linear'"
        )
    return curve


def refuse_large_strain(design: Design) -> None:
    """Raise InputError where a design asks for large strain in a scene that it is not solved for; solves nothing."""
    if design.reading is not None:
        bound = "'linear' beside [reading], whose poses are tilted"
        raise validation_error("press.strain", "large", "", bound, "drop one of them")
    check_large_strain(Scene(fruit=design.fruit, tips=design.tips, press=design.press))
