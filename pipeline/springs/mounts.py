"""The mount of a housing, modelled as elastic layers, and the lateral compliance of its tips."""

import functools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cad.parts.cover import PLATE_MM, RECESS_MM, WASHER_MM
from cad.parts.housing import SETBACK_MM, Housing
from mesh.housing.sweep import flexure_mesh
from solve.contact.scene import LateralCompliance
from solve.housing.clamped_half import SIDES, ClampedHalf, clamped_half
from solve.housing.elastic_layer import Disc, ElasticLayer, Rectangle
from solve.housing.stiffness import lever_compliance

# Thickness of a layer that represents the rough surface of a print under a washer [mm], an estimate. Without this layer
# K_h is 0.05 % higher.
SKIN_MM = 0.02
# Effective fraction of the thickness of a cover's plate. The fraction is less than 1 because the plate is stiffer than
# a bar as narrow as its rim. The value was computed with CalculiX, on tetrahedral meshes of the housing and the cover.
PLATE_FRACTION = 0.75
COARSE_SCALE = 4.0  # scale of the elements for the lateral compliance of the tips; 1 is the mesh of a run
ROUGH_SCALE = 3.0  # scale for a rough answer, whose only mesh has one layer of elements through half the depth


def mount_layers(housing: Housing) -> tuple[ElasticLayer, ...]:
    """Return the elastic layers that represent the mount between the frame and a rigid support [mm].

    A cover is a layer of the housing's material, whose outer face is held by a flat metal plate. A washer is a thin
    layer under its disc. For any other mount, the walls of the holes are fixed, and the result is empty.
    """
    holes = discs_at(housing, housing.hole_diameter)  # the layers do not cover the screw holes
    if housing.mount == "covers":
        thickness = RECESS_MM + PLATE_FRACTION * PLATE_MM
        layer = ElasticLayer(name=SIDES, thickness=thickness, rectangles=rim(housing), holes=holes)
    elif housing.mount == "washers":
        discs = discs_at(housing, WASHER_MM)
        layer = ElasticLayer(name=SIDES, thickness=SKIN_MM, rectangles=walls(housing), discs=discs, holes=holes)
    else:
        return ()
    return _layers_back_to_back(layer, housing, housing.back_to_back.gap) if housing.back_to_back else (layer,)


def _layers_back_to_back(front: ElasticLayer, housing: Housing, gap: float) -> tuple[ElasticLayer, ...]:
    """Return the layers that hold one of two plates back to back: its cover in front, and the other plate behind it.

    The back layer represents the `gap` [mm] between the plates, the second plate, and the cover of the second plate.
    The solver puts every layer on both sides of a plate. Each layer is therefore twice as thick here, which makes it
    half as stiff. As a result K_h is 0.02 % too high, which is less than the mesh error. The load on the second plate
    changes K_h even less.
    """
    back_thickness = gap + housing.depth + front.thickness
    back = ElasticLayer(name=SIDES, thickness=2.0 * back_thickness, rectangles=rim(housing), holes=front.holes)
    return replace(front, thickness=2.0 * front.thickness), back


@functools.lru_cache(maxsize=1)
def coarse_half(housing: Housing, E: float, poisson: float, *, rough: bool) -> ClampedHalf:
    """Return the factorized model of half the housing in its mount, on a coarse mesh; `E` is in MPa.

    The model is used for the lateral compliance of the tips and for the stress shown on the page. If `rough` is true,
    the mesh is the one of a rough answer, which uses no other mesh. The last result is cached in this process. Raises
    SolveError if the model cannot be solved.
    """
    mesh = flexure_mesh(housing, ROUGH_SCALE, layers=1) if rough else flexure_mesh(housing, COARSE_SCALE)
    return clamped_half(mesh, E, poisson, mount_layers(housing))


def solve_lateral_compliance(
    housing: Housing, E: float, poisson: float, K: Sequence[float], *, rough: bool
) -> LateralCompliance:
    """Compute the lateral compliance of the tips of a plate under inclined forces, on a coarse mesh; `E` is in MPa.

    The forces act at the centre of the sphere of a dome, or at a flat face. `K` (tips,) [N/mm] are stiffnesses along
    the press, which come from finer meshes. The error of the result is the largest relative difference between these
    stiffnesses and the stiffnesses on the coarse mesh. `rough` selects the mesh of a rough answer.

    Raises MeshError if the mesh cannot be made, and SolveError if it cannot be solved.
    """
    # Distance [mm] of the force from the face of the tip in the mesh, which has neither a dome nor a pin.
    height_of_force = housing.dome.radius if housing.dome else 0.0
    lever = height_of_force - housing.beyond_face
    half = coarse_half(housing, E, poisson, rough=rough)
    compliance = lever_compliance(half, lever)  # (tips, tips, 3, 3); index 2 of the last two axes is the press axis z
    error = float(np.abs(np.diag(compliance[..., 2, 2]) * K - 1.0).max())
    # The matrix C of the springs already contains the displacement along z due to forces along z.
    compliance[..., 2, 2] = 0.0
    return LateralCompliance(compliance, error)


def walls(housing: Housing) -> tuple[Rectangle, ...]:
    """Return the rectangles of the walls of a frame [mm], the left wall first: a range in x, then in z."""
    levels = (housing.protrusion, housing.top_level)
    return tuple((_sorted(arm.wall, arm.outer), levels) for arm in housing.arms)


def rim(housing: Housing) -> tuple[Rectangle, ...]:
    """Return the rectangles where a cover's rim or a pad touches the frame [mm], set back from the edges of the frame.

    The rectangles are the posts, the left one first, and the bar above the cavity. A rectangle holds its range in x and
    its range in z.
    """
    foot = max(housing.cover_level, housing.protrusion)  # z of the lower end of the cover on the posts [mm]
    top = housing.top_level
    rectangles = []
    for arm in housing.arms:
        across_post = _sorted(arm.post + arm.sign * SETBACK_MM, arm.outer)
        rectangles.append((across_post, (foot, top)))
    bar = ((housing.left, housing.right), (housing.cavity_level + SETBACK_MM, top))
    return (*rectangles, bar)


def discs_at(housing: Housing, diameter: float) -> tuple[Disc, ...]:
    """Return a disc of the given `diameter` [mm] around each mounting hole: its centre (x, z) and its radius."""
    return tuple((x, z, 0.5 * diameter) for x, z in housing.holes)


def _sorted(a: float, b: float) -> tuple[float, float]:
    """Return two numbers as a range, the smaller one first; on the left arm, an outer x is the smaller one."""
    return min(a, b), max(a, b)
