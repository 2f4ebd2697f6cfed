"""The contact geometry of spheres on an ellipsoid, a sphere or a plane, exact for any tilt. Lengths in mm.

The apex of the fruit is the origin, and z points up. A dome whose centre is closer to the fruit's surface than its
radius enters the undeformed fruit. Its springs let it move in the frame of the sensor: along the tips, across them, and
along the axis.
"""

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sensor.arrays import Floats, Ints
from sensor.design.fruit import Fruit
from solve.contact.scene import Scene, SidewaysGive
from solve.fruit.curved_shape import ellipsoid_curvatures
from solve.linear import SolveError

TOUCH_STEPS = 12  # Newton steps to a first touch: two on a plane, some five on an ellipsoid
TOUCH_LIMIT = 1e-10  # [mm]
FOOT_STEPS = 8  # most Newton steps: one is exact on a sphere, four on an ellipsoid of 2 : 1
FOOT_LIMIT = 4.0 * float(np.finfo(np.float64).eps)  # step at convergence over the least squared axis: round-off


@dataclass(frozen=True, eq=False)
class DomeApproach:
    """Position and direction of domes relative to the undeformed fruit, (poses, tips) or (poses, tips, 3).

    `interference` [mm] is the depth of a dome in the undeformed fruit along the normal, negative above it. `foot` [mm]
    is the nearest point of the fruit, `normal` [1] the normal there. `direction` [1] is the normal in the frame of the
    sensor. `radius` [mm] is the relative radius of curvature, the geometric mean of both directions. `depth_ratio` [1]
    is the depth of an elliptic contact over the depth of a round one, 1 - ln(ratio of both)^2 / 72. It agrees with
    Johnson, Contact Mechanics (1985), equations (4.26) to (4.32), to 0.1 % up to 3 : 1.
    """

    interference: Floats
    direction: Floats
    foot: Floats
    normal: Floats
    radius: Floats
    depth_ratio: Floats

    def select(self, poses: Ints) -> "DomeApproach":
        """Return the approach in some of the poses, given by their indices."""
        return DomeApproach(**{name: values[poses] for name, values in vars(self).items()})

    @property
    def cosine(self) -> Floats:
        """Return the cosine of the angle between normal and axis [1], (poses, tips)."""
        return self.direction[..., 2]


@dataclass(frozen=True, eq=False)
class DomePoses:
    """Domes of one radius [mm] on their unloaded springs, in many poses.

    `centres` (poses, tips, 3) [mm] are the centres of the spheres. The rows of `frame` (poses, 3, 3) [1] are the
    directions of the sensor: along the tips, across, and up its axis. `semi_axes` (poses, 3) [mm] belong to the fruit,
    infinite for a flat one. The rows of `principal` (poses, 3, 3) [1] are the directions of these axes; None if no
    fruit is turned.
    """

    dome_radius: float
    centres: Floats
    frame: Floats
    semi_axes: Floats
    sideways: SidewaysGive | None = None
    principal: Floats | None = None

    def select(self, poses: Ints) -> "DomePoses":
        """Return the domes in some of the poses, given by their indices."""
        return replace(
            self,
            centres=self.centres[poses],
            frame=self.frame[poses],
            semi_axes=self.semi_axes[poses],
            principal=None if self.principal is None else self.principal[poses],
        )

    def approach(self, moved: Floats) -> DomeApproach:
        """Return the approach after displacements `moved` (poses, tips, 3) [mm] in the frame of the sensor."""
        centres = self.centres + moved @ self.frame
        foot, normal = self._feet(centres)
        distance = _dot(centres - foot, normal)
        # Relative principal curvatures: the curvature of the dome is added to both of the fruit.
        least, most = self._curvatures(foot)
        least = 1.0 / self.dome_radius + least
        most = 1.0 / self.dome_radius + most
        return DomeApproach(
            interference=self.dome_radius - distance,
            direction=normal @ self.frame.swapaxes(1, 2),
            foot=foot,
            normal=normal,
            radius=1.0 / np.sqrt(least * most),
            depth_ratio=1.0 - np.log(most / least) ** 2 / 72.0,
        )

    def from_face_middle(self, approach: DomeApproach) -> Floats:
        """Return the distance of the contact from the middle of a dome's face, across its axis [mm], (poses, tips)."""
        touching = -self.dome_radius * approach.direction[..., :2]  # from the axis of the sphere
        return np.asarray(np.linalg.norm(touching, axis=-1))

    def _feet(self, centres: Floats) -> tuple[Floats, Floats]:
        """Return the nearest points of the fruit and its normals there, both (poses, tips, 3)."""
        if np.isinf(self.semi_axes).any():
            return centres * np.array([1.0, 1.0, 0.0]), np.broadcast_to([0.0, 0.0, 1.0], centres.shape)
        squares = self.semi_axes[:, None] ** 2
        middle = np.zeros_like(squares)
        middle[..., 2] = -self.semi_axes[:, None, 2]
        foot = _nearest(self._to_principal(centres - middle), squares)
        normal = foot / squares
        normal = normal / np.sqrt(_dot(normal, normal))[..., None]
        return middle + self._from_principal(foot), self._from_principal(normal)

    def _to_principal(self, vectors: Floats) -> Floats:
        """Return the components of vectors (poses, tips, 3) along the fruit's principal directions [same unit]."""
        return vectors if self.principal is None else vectors @ self.principal.swapaxes(1, 2)

    def _from_principal(self, vectors: Floats) -> Floats:
        """Return vectors (poses, tips, 3) from their components along the fruit's principal directions [same unit]."""
        return vectors if self.principal is None else vectors @ self.principal

    def _curvatures(self, foot: Floats) -> tuple[Floats, Floats]:
        """Return the smaller and the larger principal curvature of the fruit at the feet [1/mm], both (poses, tips)."""
        if np.isinf(self.semi_axes).any():
            flat = np.zeros(foot.shape[:2])
            return flat, flat
        axes = self.semi_axes[:, None]
        from_centre = foot + np.concatenate([np.zeros_like(axes[..., :2]), axes[..., 2:]], axis=-1)
        mean, gauss = ellipsoid_curvatures(axes, self._to_principal(from_centre))
        spread = np.sqrt(np.maximum(mean**2 - gauss, 0.0))
        return mean - spread, mean + spread


def _nearest(point: Floats, squares: Floats) -> Floats:
    """Return the points of ellipsoids nearest to points outside them, both (..., 3) [mm] from the centre.

    `squares` (..., 3) [mm^2] are the squares a_k^2 of the semi-axes. For some t >= 0 [mm^2] the point nearest to s has
    the coordinates a_k^2 s_k / (t + a_k^2). It lies on the ellipsoid if |q| = 1, with q_k = a_k s_k / (t + a_k^2).
    Newton's method finds t from 1 / |q| - 1, which is nearly linear in t.
    """
    t = np.zeros(point.shape[:-1])
    settled = FOOT_LIMIT * squares.min()
    for _ in range(FOOT_STEPS if np.ptp(squares, axis=-1).any() else 1):
        denominator = t[..., None] + squares
        q = np.sqrt(squares) * point / denominator
        size = np.sqrt(_dot(q, q))
        slope = _dot(q, q / denominator) / size**3  # slope of 1 / |q| over t
        step = (1.0 / size - 1.0) / slope
        t = t - step
        if np.abs(step).max(initial=0.0) <= settled:
            break
    return squares * point / (t[..., None] + squares)


def _dot(a: Floats, b: Floats) -> Floats:
    """Return the scalar products of vectors (..., 3).

    einsum takes a quarter of the time of a sum over so short an axis.
    """
    return np.asarray(np.einsum("...k,...k->...", a, b))


def dome_poses(scenes: Sequence[Scene], travel: Floats) -> DomePoses:
    """Return the domes in scenes of one sensor, each at its own travel [mm], (poses,).

    Travel is vertical from the first touch of a level sensor. If a scene has `from_touch`, it is along the axis from
    the first touch in the pose. Raises SolveError if no first touch is found.
    """
    axis = _axes(np.array([scene.turn for scene in scenes]))
    # Poses that differ only in travel or in a turn after the first touch share this touch, which is found once.
    touching = {id(scene): _at_touch(scene) for scene in {id(scene): scene for scene in scenes}.values()}
    stands = {_stand(scene): scene for scene in touching.values()}
    found = dict(zip(stands, _first_touches(list(stands.values())), strict=True))
    touches = np.array([found[_stand(touching[id(scene)])] for scene in scenes])
    aimed, lowered = touches[:, :3], touches[:, 3:]
    from_touch = np.array([scene.from_touch for scene in scenes])
    pressed_along = np.where(from_touch[:, None], axis, np.array([0.0, 0.0, 1.0]))
    return _standing(scenes, axis, aimed - (travel[:, None] + lowered) * pressed_along)


def _at_touch(scene: Scene) -> Scene:
    """Return the scene whose first touch is the zero of travel: the scene itself, or the scene of a level sensor."""
    if scene.from_touch:
        return scene
    level = replace(scene.press, tilt_deg=0.0, roll_deg=0.0)
    return replace(scene, press=level, height_offset_mm=())


def _stand(scene: Scene) -> tuple[object, ...]:
    """Return the properties that determine the first touch: fruit, press, place and heights of the tips."""
    return scene.fruit, scene.press, scene.off_centre_mm, scene.height_offset_mm


def _axes(turn: Floats) -> Floats:
    """Return the axes of sensors [1], (poses, 3), from the tangents of their tilts, (poses, 2)."""
    axis = np.column_stack([turn, np.ones(len(turn))])
    return np.asarray(axis / np.linalg.norm(axis, axis=1, keepdims=True))


def _first_touches(scenes: Sequence[Scene]) -> Floats:
    """Return the point of the skin that each sensor aims at, and its lowering at first touch, (scenes, 4) [mm].

    The first three columns are the point of the skin under the middle of the tips. The last one is the distance by
    which the middle of the faces is lowered along the axis beyond this point. Raises SolveError if Newton's method does
    not converge.
    """
    axis = _axes(np.array([scene.turn_at_touch for scene in scenes]))
    middle = np.array([scene.centres for scene in scenes]).mean(axis=1)
    fall = np.array([scene.fruit.fall_mm(x, y) for scene, (x, y) in zip(scenes, middle.tolist(), strict=True)])
    aimed = np.column_stack([middle, -fall])
    lowered = np.zeros(len(scenes))
    for _ in range(TOUCH_STEPS):
        domes = _standing(scenes, axis, aimed - lowered[:, None] * axis)
        approach = domes.approach(np.zeros(domes.centres.shape))
        # The sensor moves back by the depth of the deepest dome along the axis.
        entered = (approach.interference / approach.cosine).max(axis=1)
        lowered = lowered - entered
        if np.abs(entered).max() <= TOUCH_LIMIT:
            return np.column_stack([aimed, lowered])
    msg = f"first touch of domes: error of {np.abs(entered).max():.1e} mm must be at most {TOUCH_LIMIT:g} mm"
    raise SolveError(msg)


def _standing(scenes: Sequence[Scene], axis: Floats, origin: Floats) -> DomePoses:
    """Return the domes of sensors with these axes [1] and origins [mm], both (poses, 3).

    The origin is the middle of the level faces of the tips.
    """
    radius = float(scenes[0].tips.dome_radius_mm or 0.0)
    # Many poses share a scene, whose properties are computed once.
    unique = {id(scene): scene for scene in scenes}
    place_of = {key: place for place, key in enumerate(unique)}
    which = np.array([place_of[id(scene)] for scene in scenes])
    made = list(unique.values())
    centres = np.array([scene.centres for scene in made])[which]
    middle = centres.mean(axis=1)
    # height of the spheres' centres above the level faces
    height = radius - np.array([scene.height_offsets_mm for scene in made])[which]

    # `level` are x and y after the shortest rotation that takes the vertical to the axis.
    between = (axis + np.array([0.0, 0.0, 1.0])) / (1.0 + axis[:, 2:])
    level = np.eye(3)[:2] - axis[:, :2, None] * between[:, None]

    semi_axes, principal = zip(*(_principal_axes(scene.fruit) for scene in made), strict=True)
    return DomePoses(
        dome_radius=radius,
        centres=origin[:, None] + (centres - middle[:, None]) @ level + height[..., None] * axis[:, None],
        frame=np.concatenate([level, axis[:, None]], axis=1),
        semi_axes=np.array(semi_axes)[which],
        principal=np.array(principal)[which] if any(scene.fruit.azimuth_deg for scene in made) else None,
        sideways=scenes[0].sideways,
    )


@functools.lru_cache(maxsize=256)
def _principal_axes(fruit: Fruit) -> tuple[Floats, Floats]:
    """Return the semi-axes [mm] of a fruit and its principal directions [1], in rows."""
    along, across = fruit.radii_mm
    directions = np.eye(3)
    directions[0, :2] = fruit.from_principal(1.0, 0.0)
    directions[1, :2] = fruit.from_principal(0.0, 1.0)
    return np.array([along, math.sqrt(along * across), along]), directions
