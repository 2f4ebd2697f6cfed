"""The contact geometry of spherical domes on an ellipsoid, a sphere or a plane, exact at any tilt. Lengths are in mm.

The origin is the apex of the fruit, and z points up. A dome overlaps the undeformed fruit if the centre of its sphere
is closer to the surface than the radius of the sphere. On its spring, a dome can move in three directions of the sensor
frame: along the tips, across them, and along the axis.
"""

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sensor.arrays import Floats, Ints
from sensor.design.fruit import Fruit
from solve.contact.scene import LateralCompliance, Scene
from solve.fruit.curved_shape import ellipsoid_curvatures
from solve.linear import SolveError

# Maximum number of Newton steps to a first touch. A plane takes two steps, and an ellipsoid takes about five.
TOUCH_STEPS = 12
TOUCH_LIMIT = 1e-10  # largest overlap at a first touch [mm]
# Maximum number of Newton steps to a nearest point. A sphere takes one step, and a 2 : 1 ellipsoid takes four.
MAX_NEWTON_STEPS = 8
# Step at convergence divided by the smallest squared semi-axis: a few units of round-off.
NEAREST_TOLERANCE = 4.0 * float(np.finfo(np.float64).eps)


@dataclass(frozen=True, eq=False)
class DomeApproach:
    """The position of domes relative to the undeformed fruit; arrays are (poses, tips) or (poses, tips, 3).

    `interference` [mm] is the depth of a dome in the fruit along the normal; it is negative without overlap. `foot`
    [mm] is the point of the fruit nearest to the centre of the dome, and `normal` [1] the outward normal there.
    `direction` [1] is the same normal in the sensor frame. `radius` [mm] is the relative radius of curvature, the
    geometric mean of the two principal values. `depth_ratio` [1] is the depth of an elliptical contact divided by the
    depth of a circular contact with the same force. It is 1 - ln(ratio of the principal radii)^2 / 72. This formula
    agrees with K. L. Johnson, Contact Mechanics (1985), equations (4.26) to (4.32), to 0.1 % up to a ratio of 3 : 1.
    """

    interference: Floats
    direction: Floats
    foot: Floats
    normal: Floats
    radius: Floats
    depth_ratio: Floats

    def select(self, poses: Ints) -> "DomeApproach":
        """Return the approach for a subset of the poses, given by their indices."""
        return DomeApproach(**{name: values[poses] for name, values in vars(self).items()})

    @property
    def cosine(self) -> Floats:
        """Return the cosine of the angle between the normal and the axis of the sensor [1], (poses, tips)."""
        return self.direction[..., 2]


@dataclass(frozen=True, eq=False)
class DomePoses:
    """Domes on undeflected springs, and the fruits under them, in many poses.

    `dome_radius` [mm] is the radius of the spheres, and `centres` (poses, tips, 3) [mm] are their centres. The rows of
    `frame` (poses, 3, 3) [1] are the directions of the sensor: along the tips, across them, and up its axis.
    `semi_axes` (poses, 3) [mm] are the semi-axes of the fruits, infinite for a flat fruit. The rows of `principal`
    (poses, 3, 3) [1] are the directions of these semi-axes. `principal` is None if the semi-axes of all fruits are
    parallel to x, y and z. `sideways` is the lateral compliance of the tips, if it is known.
    """

    dome_radius: float
    centres: Floats
    frame: Floats
    semi_axes: Floats
    sideways: LateralCompliance | None = None
    principal: Floats | None = None

    def select(self, poses: Ints) -> "DomePoses":
        """Return the domes for a subset of the poses, given by their indices."""
        return replace(
            self,
            centres=self.centres[poses],
            frame=self.frame[poses],
            semi_axes=self.semi_axes[poses],
            principal=None if self.principal is None else self.principal[poses],
        )

    def approach(self, displacements: Floats) -> DomeApproach:
        """Return the position of the domes relative to the undeformed fruit after the springs have deflected.

        `displacements` (poses, tips, 3) [mm] are the displacements of the domes, in the sensor frame.
        """
        centres = self.centres + displacements @ self.frame  # in the coordinates of the fruit
        foot, normal = self._nearest_points(centres)
        distance = _dot(centres - foot, normal)
        fruit_smaller, fruit_larger = self._curvatures(foot)
        # The relative principal curvatures are the curvatures of the fruit plus the curvature of the dome.
        smaller = 1.0 / self.dome_radius + fruit_smaller
        larger = 1.0 / self.dome_radius + fruit_larger
        return DomeApproach(
            interference=self.dome_radius - distance,
            direction=normal @ self.frame.swapaxes(1, 2),  # the components along the rows of the frame
            foot=foot,
            normal=normal,
            radius=1.0 / np.sqrt(smaller * larger),
            depth_ratio=1.0 - np.log(larger / smaller) ** 2 / 72.0,  # see the docstring of DomeApproach
        )

    def distance_from_face_middle(self, approach: DomeApproach) -> Floats:
        """Return the distance of each contact from the middle of its tip face [mm], (poses, tips).

        The middle of the face lies on the axis of the dome.
        """
        from_axis = -self.dome_radius * approach.direction[..., :2]
        return np.asarray(np.linalg.norm(from_axis, axis=-1))

    def _nearest_points(self, centres: Floats) -> tuple[Floats, Floats]:
        """Return the points of the fruit nearest to `centres` [mm] and its unit normals there, (poses, tips, 3)."""
        if np.isinf(self.semi_axes).any():  # the fruit is flat: the plane z = 0
            return centres * np.array([1.0, 1.0, 0.0]), np.broadcast_to([0.0, 0.0, 1.0], centres.shape)
        squares = self.semi_axes[:, None] ** 2
        fruit_centre = np.zeros_like(squares)
        fruit_centre[..., 2] = -self.semi_axes[:, None, 2]  # below the apex, which is the origin
        foot = _nearest_on_ellipsoid(self._to_principal(centres - fruit_centre), squares)
        normal = foot / squares  # gradient of sum (x_k / a_k)^2, up to a constant factor
        normal = normal / np.sqrt(_dot(normal, normal))[..., None]
        return fruit_centre + self._from_principal(foot), self._from_principal(normal)

    def _to_principal(self, vectors: Floats) -> Floats:
        """Return the components of vectors (poses, tips, 3) along the fruit's principal directions [same unit]."""
        return vectors if self.principal is None else vectors @ self.principal.swapaxes(1, 2)

    def _from_principal(self, vectors: Floats) -> Floats:
        """Return vectors (poses, tips, 3) from their components along the fruit's principal directions [same unit]."""
        return vectors if self.principal is None else vectors @ self.principal

    def _curvatures(self, foot: Floats) -> tuple[Floats, Floats]:
        """Return the smaller and the larger principal curvature of the fruit at `foot` [1/mm], (poses, tips)."""
        if np.isinf(self.semi_axes).any():
            flat = np.zeros(foot.shape[:2])
            return flat, flat
        axes = self.semi_axes[:, None]
        # The apex is the origin, so the centre of the fruit lies one semi-axis below it.
        from_centre = foot + np.concatenate([np.zeros_like(axes[..., :2]), axes[..., 2:]], axis=-1)
        mean, gauss = ellipsoid_curvatures(axes, self._to_principal(from_centre))
        # The principal curvatures are the roots k of k^2 - 2 mean k + gauss = 0. On a sphere, the radicand is 0, and
        # round-off can make it negative.
        half_difference = np.sqrt(np.maximum(mean**2 - gauss, 0.0))
        return mean - half_difference, mean + half_difference


def _nearest_on_ellipsoid(point: Floats, squared_axes: Floats) -> Floats:
    """Return the points of ellipsoids nearest to points outside them, both (..., 3) [mm] relative to the centre.

    `squared_axes` (..., 3) [mm^2] are the squared semi-axes a_k^2, and s is `point`. The vector from the nearest point
    to s is parallel to the normal there. Therefore, for some t >= 0 [mm^2], the nearest point has the coordinates

        a_k^2 s_k / (t + a_k^2).

    It lies on the ellipsoid if |q| = 1, with q_k = a_k s_k / (t + a_k^2). So t is the zero of 1 / |q| - 1. Newton's
    method finds it quickly, because 1 / |q| is nearly linear in t. If the last step still exceeds the tolerance, its
    result is used anyway.
    """
    t = np.zeros(point.shape[:-1])
    tolerance = NEAREST_TOLERANCE * squared_axes.min()
    are_spheres = not np.ptp(squared_axes, axis=-1).any()
    max_steps = 1 if are_spheres else MAX_NEWTON_STEPS  # on a sphere, one step is exact
    for _ in range(max_steps):
        denominator = t[..., None] + squared_axes
        q = np.sqrt(squared_axes) * point / denominator
        norm = np.sqrt(_dot(q, q))
        slope = _dot(q, q / denominator) / norm**3  # derivative of 1 / |q| with respect to t
        step = (1.0 / norm - 1.0) / slope
        t = t - step
        if np.abs(step).max(initial=0.0) <= tolerance:
            break
    return squared_axes * point / (t[..., None] + squared_axes)


def _dot(a: Floats, b: Floats) -> Floats:
    """Return the scalar products of vectors (..., 3).

    On such a short axis, einsum takes a quarter of the time of a product and a sum.
    """
    return np.asarray(np.einsum("...k,...k->...", a, b))


def dome_poses(scenes: Sequence[Scene], travel: Floats) -> DomePoses:
    """Return the domes of one sensor in many poses, given a scene and a travel [mm] for each pose.

    The travel is vertical, and starts at the first touch of a level sensor. In a scene with `from_touch`, it is along
    the axis of the sensor, and starts at the first touch in that pose. Raises SolveError if no first touch is found.
    """
    axis = _axes(np.array([scene.tilt_tangents for scene in scenes]))
    touches = _zero_travel_touches(scenes)
    skin_points = touches[:, :3]
    lowering = touches[:, 3:]  # distance from the skin down to the tip faces, along the axis
    from_touch = np.array([scene.from_touch for scene in scenes])
    upward = np.where(from_touch[:, None], axis, np.array([0.0, 0.0, 1.0]))  # opposite to the direction of the travel
    return _place_domes(scenes, axis, skin_points - (travel[:, None] + lowering) * upward)


def _zero_travel_touches(scenes: Sequence[Scene]) -> Floats:
    """Return the first touch from which the travel of each scene is measured, (scenes, 4) [mm].

    The first three columns are the point of the skin under the middle of the tips. The last column is the distance
    along the axis from this point down to the middle of the level faces; it is negative if they are above the skin.
    """
    # Many poses share a scene, and many scenes share a first touch, so each first touch is computed only once.
    distinct_scenes, scene_index = _distinct_scenes(scenes)
    touch_scenes = [_touch_scene(scene) for scene in distinct_scenes]
    scene_by_key = {_touch_key(scene): scene for scene in touch_scenes}
    touch_by_key = dict(zip(scene_by_key, _first_touches(list(scene_by_key.values())), strict=True))
    return np.array([touch_by_key[_touch_key(scene)] for scene in touch_scenes])[scene_index]


def _touch_scene(scene: Scene) -> Scene:
    """Return the scene from whose first touch the travel is measured: this scene, or its level version without sag."""
    if scene.from_touch:
        return scene
    level = replace(scene.press, tilt_deg=0.0, roll_deg=0.0)
    return replace(scene, press=level, height_offset_mm=())


def _touch_key(scene: Scene) -> tuple[object, ...]:
    """Return the fields that determine the first touch: the fruit, and the tilt, offset and heights of the tips."""
    return scene.fruit, scene.press, scene.off_centre_mm, scene.height_offset_mm


def _axes(tangents: Floats) -> Floats:
    """Return the unit axes of sensors (poses, 3), given the tangents of their tilt and roll (poses, 2)."""
    axis = np.column_stack([tangents, np.ones(len(tangents))])
    return np.asarray(axis / np.linalg.norm(axis, axis=1, keepdims=True))


def _first_touches(scenes: Sequence[Scene]) -> Floats:
    """Return the position of each sensor at its first touch, (scenes, 4) [mm].

    The first three columns are the point of the skin under the middle of the tips. The last column is the distance
    along the axis from this point down to the middle of the level faces. Newton's method moves each sensor along its
    axis until the largest overlap of a dome is 0. Raises SolveError if it does not converge.
    """
    axis = _axes(np.array([scene.tilt_tangents_at_touch for scene in scenes]))
    middle = np.array([scene.centres for scene in scenes]).mean(axis=1)  # in plan
    skin_depth = np.array([scene.fruit.fall_mm(x, y) for scene, (x, y) in zip(scenes, middle.tolist(), strict=True)])
    skin_points = np.column_stack([middle, -skin_depth])
    lowering = np.zeros(len(scenes))  # distance from the skin down to the tip faces, along the axis
    for _ in range(TOUCH_STEPS):
        domes = _place_domes(scenes, axis, skin_points - lowering[:, None] * axis)
        approach = domes.approach(np.zeros(domes.centres.shape))
        # An interference is measured along the normal. Along the axis, the overlap is larger by 1 / cosine.
        overlap = (approach.interference / approach.cosine).max(axis=1)
        lowering = lowering - overlap
        if np.abs(overlap).max() <= TOUCH_LIMIT:
            return np.column_stack([skin_points, lowering])
    error = np.abs(overlap).max()
    msg = f"first touch of domes: error of {error:.1e} mm must be at most {TOUCH_LIMIT:g} mm. Press more level."
    raise SolveError(msg)


def _place_domes(scenes: Sequence[Scene], axis: Floats, origin: Floats) -> DomePoses:
    """Return the domes of sensors with the given axes [1] and origins [mm], both (poses, 3), for one scene per pose.

    The origin of a sensor is the middle of its tip faces, ignoring the height offsets of the tips.
    """
    radius = float(scenes[0].tips.dome_radius_mm or 0.0)  # never None for domes
    # Many poses share a scene, so the properties of each scene are computed only once. Indexing with `scene_index`
    # then repeats them for each pose.
    distinct_scenes, scene_index = _distinct_scenes(scenes)
    centres = np.array([scene.centres for scene in distinct_scenes])[scene_index]
    middle = centres.mean(axis=1)
    # Heights of the sphere centres above the origin, along the axis. A retracted tip has a negative offset.
    height = radius - np.array([scene.height_offsets_mm for scene in distinct_scenes])[scene_index]
    lateral = _lateral_directions(axis)

    is_rotated = any(scene.fruit.azimuth_deg for scene in distinct_scenes)
    axes_of_scenes = [_principal_axes(scene.fruit) for scene in distinct_scenes]
    semi_axes, principal = zip(*axes_of_scenes, strict=True)
    return DomePoses(
        dome_radius=radius,
        centres=origin[:, None] + (centres - middle[:, None]) @ lateral + height[..., None] * axis[:, None],
        frame=np.concatenate([lateral, axis[:, None]], axis=1),
        semi_axes=np.array(semi_axes)[scene_index],
        principal=np.array(principal)[scene_index] if is_rotated else None,
        sideways=scenes[0].sideways,
    )


def _distinct_scenes(scenes: Sequence[Scene]) -> tuple[list[Scene], Ints]:
    """Return the distinct scene objects of many poses, and the index (poses,) of the scene of each pose among them."""
    scenes_by_id = {id(scene): scene for scene in scenes}
    index_by_id = {key: index for index, key in enumerate(scenes_by_id)}
    return list(scenes_by_id.values()), np.array([index_by_id[id(scene)] for scene in scenes])


def _lateral_directions(axis: Floats) -> Floats:
    """Return the directions along the tips and across them (poses, 2, 3), given the axes of sensors (poses, 3).

    The two directions are the images of the x and y directions under the smallest rotation from the vertical z to the
    axis a. This rotation maps a horizontal direction v to v - (a . v) (a + z) / (1 + a . z).
    """
    bisector = (axis + np.array([0.0, 0.0, 1.0])) / (1.0 + axis[:, 2:])
    return np.asarray(np.eye(3)[:2] - axis[:, :2, None] * bisector[:, None])


@functools.lru_cache(maxsize=256)
def _principal_axes(fruit: Fruit) -> tuple[Floats, Floats]:
    """Return the semi-axes of a fruit (3,) [mm], and its principal directions as the rows of a matrix (3, 3).

    The principal radii of curvature at the apex are a_x^2 / a_z and a_y^2 / a_z. With a_z = a_x, they are a_x and
    a_y^2 / a_x, which determines the semi-axes.
    """
    along, across = fruit.radii_mm
    directions = np.eye(3)
    directions[0, :2] = fruit.from_principal(1.0, 0.0)
    directions[1, :2] = fruit.from_principal(0.0, 1.0)
    return np.array([along, math.sqrt(along * across), along]), directions
