"""What holds the frame as the solver takes it: layers on its side faces where covers or washers press on it."""

from dataclasses import replace

from cad.parts.cover import PLATE_MM, RECESS_MM, SETBACK_MM, WASHER_MM
from cad.parts.housing import HeldBy, Housing
from pipeline.fit.foils import bonded_foils
from solve.housing.elastic_layer import Disc, ElasticLayer, Rectangle
from solve.housing.held_half import SIDES, Attached

# The rough skin of a print under a washer, a judgement: without it K_h is 0.05 % higher. tests/reference/test_mounts.py
SKIN_MM = 0.02
# Of the plate of a cover, which gives less than a strip as narrow as its rim. tests/reference/test_mounts.py
PLATE_SHARE = 0.75


def attached_to(housing: Housing) -> tuple[Attached, ...]:
    """Return what is attached to a housing [mm]: its gauges, and the layers of its mount.

    Raises InputError where a leaf has no room for its gauges.
    """
    return (*bonded_foils(housing), *mount_layers(housing))


def mount_layers(housing: Housing) -> tuple[ElasticLayer, ...]:
    """Return the layers between the frame and the ground [mm], none where the walls of its holes are held.

    A cover is a layer of the housing's material whose outer face a flat plate of metal holds.
    """
    holes = _discs(housing, housing.hole_diameter)
    if housing.mount == "covers":
        thickness = RECESS_MM + PLATE_SHARE * PLATE_MM
        return (ElasticLayer(name=SIDES, thickness=thickness, rectangles=rim(housing), holes=holes),)
    if housing.mount == "washers":
        discs = _discs(housing, WASHER_MM)
        return (ElasticLayer(name=SIDES, thickness=SKIN_MM, rectangles=walls(housing), discs=discs, holes=holes),)
    return ()


def walls(housing: Housing) -> tuple[Rectangle, ...]:
    """Return the walls of a frame [mm], the left one first."""
    levels = (housing.protrusion, housing.top_level)
    return tuple((_sorted(arm.wall, arm.outer), levels) for arm in housing.arms)


def rim(housing: Housing) -> tuple[Rectangle, ...]:
    """Return where the rim of a cover lies on the frame [mm]: on both walls and on the bar, set back from its edges."""
    foot, top = max(housing.cover_level, housing.protrusion), housing.top_level
    sides = [(_sorted(arm.wall + arm.sign * SETBACK_MM, arm.outer), (foot, top)) for arm in housing.arms]
    bar = ((housing.left, housing.right), (housing.cavity_level + SETBACK_MM, top))
    return (*sides, bar)


def held_by(housing: Housing, mount: HeldBy) -> Housing:
    """Return the housing [mm] in another mount."""
    return replace(housing, mount=mount)


def _discs(housing: Housing, diameter: float) -> tuple[Disc, ...]:
    return tuple((x, z, 0.5 * diameter) for x, z in housing.holes)


def _sorted(a: float, b: float) -> tuple[float, float]:
    return min(a, b), max(a, b)
