"""Four rigid, slippery domes on springs on a piece of an ellipsoid at finite strain, in any pose, by tetrahedra.

Nothing of a law of contact is in them. They have curved tetrahedra of second order, neo-Hooke in the tensor form, and
springs as unknowns beside the nodes. The skin is held out of the spheres themselves at points of its faces. Domes move
along the axis of the sensor alone, and the sensor is pressed along it. Sensors and fruits are those of
`solve/presses`.

**One mesh for all presses.** It is a box, finest under four places. Eight mirror images of a part make it, so that it
treats all domes alike. Bent, its top is the skin of the ellipsoid, and the places lie where the domes first touch. Its
base is flat and held, its sides are free.

**One factor for many samples.** The pressure of a point on the skin is extrapolated from the samples before. A soft
penalty on its penetration adds to it (augmented Lagrangian). Newton's steps are those of conjugate gradients,
preconditioned by an old factor as long as it serves.

**Error.** From 14,000 to 35,000 dofs forces move by 0.3 %, and a modulus read from them by less than 1 %.
Lengths in mm, forces in N, moduli in MPa; within a press E = 1.
"""

import functools
import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import gmsh
import numpy as np
from scipy.optimize import minimize
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import LinearOperator, cg, splu
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTet, RefTri

from mesh.session import element_nodes, gmsh_session, used_nodes
from reference.flesh_elements import EDGES, flesh, shapes
from sensor.arrays import Floats, Ints
from solve.presses.bodies import EllipsoidFruit, SprungDomes
from solve.presses.pressing import Slope

Place = tuple[Floats, Floats]  # the axis up the sensor (3,), and the centres of the domes (tips, 3) [mm]
State = tuple[Floats, Floats]  # unknowns, and pressures at the points of the faces

MIRRORED = (1, 0, 2, 3, 4, 6, 5, 9, 8, 7)  # the nodes of a tetrahedron of gmsh that is turned inside out
IMAGES = (((1, 0, 2), (1.0, 1.0, 1.0)), ((0, 1, 2), (-1.0, 1.0, 1.0)), ((0, 1, 2), (1.0, -1.0, 1.0)))
HALF = 12.0  # of the box in plan, and its depth
FOOT = 2.3  # x and y of the places
PLACES = FOOT * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])  # in the order of the domes
ON = 1e-6
UP = np.array([0.0, 0.0, 1.0])
SIZE = 0.65  # of the elements under the places
REACH = 1.8  # from a place, within which they are of this size
GROWTH = 0.4  # of the size over the distance beyond
COARSEST = 4.0
NEAR = 3.5  # how far from a place the skin may touch
PENALTY = 100.0  # pressure over penetration
FIRST = ((0.1 * PENALTY, 1e-2), (PENALTY, 1e-3), (PENALTY, 1e-3), (PENALTY, 3e-4))
"""Penalties of a first sample, each with how far forces may be out of balance over those of the springs."""
SETTLED = 3  # samples from which pressures are extrapolated well enough for one pass
FIRMEST = 0.5  # pressure over E beyond any that occurs
STEPS = 40


@dataclass(frozen=True, kw_only=True)
class Piece:
    """A piece of fruit about its apex: the side of its plan, the flesh over a rigid stone, and the elements [mm].

    `size` is that of the elements under the places.
    """

    plan: float = 24.0
    thickness: float = 12.0
    size: float = SIZE


def rise_of_skin(fruit: EllipsoidFruit, x: Floats, y: Floats) -> Floats:
    """Return how far the ellipsoid lies over the plane through its apex [mm], at most 0."""
    angle = np.radians(fruit.azimuth)
    along = x * np.cos(angle) + y * np.sin(angle)
    across = y * np.cos(angle) - x * np.sin(angle)
    return fruit.R1 * (np.sqrt(1.0 - (along / fruit.R1) ** 2 - across**2 / (fruit.R1 * fruit.R2)) - 1.0)


class Stand:
    """How a sensor stands on a fruit whose apex is the origin, z up.

    `feet` (tips, 2) [mm] are x and y of where each dome would touch first, `late` (tips,) [mm] the travel of the sensor
    at that touch.
    """

    def __init__(self, sensor: SprungDomes, fruit: EllipsoidFruit) -> None:
        """Find where each dome first touches, by minimising its way down to the skin."""
        self.sensor, self.fruit = sensor, fruit
        self.first = 0.0
        axis, centres = self.placed(0.0)

        def room(place: Floats, centre: Floats) -> float:
            """Return how far a dome may go down its axis before it meets the skin at a place [mm]."""
            beside = centre - [*place, rise_of_skin(fruit, *place)]
            along = beside @ axis
            return along - np.sqrt(sensor.dome_radius**2 - beside @ beside + along**2)

        found = [minimize(room, centre[:2], (centre,), tol=1e-10) for centre in centres]
        self.feet = np.array([one.x for one in found])
        self.first = min(one.fun for one in found)
        self.late = np.array([one.fun - self.first for one in found])

    def placed(self, travel: float, changed_slope: Slope = (0.0, 0.0)) -> Place:
        """Return the axis up the sensor (3,) and the centres of the domes (tips, 3) [mm] on springs without load."""
        slope = np.append(self.fruit.slope + changed_slope, 1.0)
        axis = slope / np.linalg.norm(slope)
        level = np.eye(2, 3) - np.outer(axis[:2], axis + UP) / (1.0 + axis[2])  # turned the shortest way
        up = self.sensor.dome_radius - self.first - travel - np.broadcast_to(self.fruit.heights, len(self.sensor.K))
        return axis, self.sensor.positions @ level - np.append(self.fruit.apex, 0.0) + np.outer(up, axis)


@functools.lru_cache(maxsize=4)
def box(size: float) -> tuple[Floats, Ints, Ints]:
    """Return nodes (n, 3), tetrahedra (10, m) and faces of the top (6, k) of a box of a size under its places.

    An eighth of it is meshed; three mirror images, each of all before, make the rest.
    """

    def wanted(_dimension: int, _tag: int, x: float, y: float, z: float, _size: float) -> float:  # as gmsh calls it
        distance = np.sqrt((x - FOOT) ** 2 + (y - FOOT) ** 2 + z**2)
        return min(size + GROWTH * max(0.0, distance - REACH), COARSEST)

    with gmsh_session():
        occ = gmsh.model.occ
        points = [occ.addPoint(*place, -HALF) for place in ((0.0, 0.0), (HALF, 0.0), (HALF, HALF))]
        lines = [occ.addLine(points[i - 1], points[i]) for i in range(3)]
        occ.extrude([(2, occ.addPlaneSurface([occ.addCurveLoop(lines)]))], 0.0, 0.0, HALF)
        occ.synchronize()
        gmsh.model.mesh.setSizeCallback(wanted)
        gmsh.option.setNumber("Mesh.ElementOrder", 2.0)
        gmsh.model.mesh.generate(3)
        solid, faces = element_nodes("Tetrahedron", 2), element_nodes("Triangle", 2)
        nodes = used_nodes(solid)
    x, solid, faces = nodes.points.T, nodes.index[solid], nodes.index[faces]
    faces = faces[:, (x[faces, 2] > -ON).all(axis=0)]
    for order, signs in IMAGES:
        # Nodes on the mirror plane are their own images: the same points to six digits are one node.
        both = np.concatenate([x, x[:, order] * signs])
        _, kept, same = np.unique(both.round(6), axis=0, return_index=True, return_inverse=True)
        solid = same[np.concatenate([solid, solid[MIRRORED, :] + len(x)], axis=1)]
        faces = same[np.concatenate([faces, faces + len(x)], axis=1)]
        x = both[kept]
    return x, solid, faces


def bent(x: Floats, fruit: EllipsoidFruit, piece: Piece, feet: Floats) -> Floats:
    """Return the nodes (n, 3) [mm] of a box as those of a piece of a fruit, its places at feet (4, 2).

    The plan is stretched to that of the piece, its places are moved to the feet, and columns end at the skin.
    """
    plan = x[:, :2] * (1.0 + (0.5 * piece.plan / HALF - 1.0) * (x[:, :2] / HALF) ** 2)
    inside = np.prod((1.0 - (x[:, :2] / HALF) ** 2) / (1.0 - (FOOT / HALF) ** 2), axis=1)
    for place, foot in zip(PLACES, feet, strict=True):
        plan += np.outer(inside * np.prod(0.5 * (1.0 + x[:, :2] / place), axis=1), foot - place)
    deep = -x[:, 2] + (piece.thickness - HALF) * (x[:, 2] / HALF) ** 2  # near the skin as in the box
    rise = rise_of_skin(fruit, *plan.T)
    return np.column_stack([plan, rise - deep * (1.0 + rise / piece.thickness)])


class Pattern:
    """Where the entries of elements, (m, n, n) by their `dofs` (m, n), go in one sparse matrix; dof -1 is held."""

    def __init__(self, *dofs: Ints) -> None:
        """Give each entry of the elements its place among those of the matrix, column by column."""
        self.size = 1 + max(each.max() for each in dofs)
        found = []
        for each in dofs:
            rows, columns = each[:, :, None], each[:, None, :]
            # What is held goes to one place past the end.
            found.append(np.where((rows < 0) | (columns < 0), self.size**2, columns * self.size + rows).ravel())
        keys, self.entry = np.unique(np.concatenate(found), return_inverse=True)
        self.count = np.searchsorted(keys, self.size**2)
        columns, self.rows = np.divmod(keys[: self.count], self.size)
        self.starts = np.searchsorted(columns, np.arange(self.size + 1))

    def matrix(self, *entries: Floats) -> Any:
        """Return the sum of element matrices, in the order in which their dofs were given."""
        values = np.bincount(self.entry, np.concatenate([each.ravel() for each in entries]), self.count + 1)
        return csc_matrix((values[: self.count], self.rows, self.starts), shape=(self.size, self.size))

    def vector(self, dofs: Ints, entries: Floats) -> Floats:
        """Return the sum of element vectors, both (m, n)."""
        return np.bincount(dofs.ravel() + 1, entries.ravel(), self.size + 1)[1:].astype(np.float64, copy=False)


class Numbers:
    """Unknowns of a box under four domes: displacements of its nodes but for the base, then the ways of the domes."""

    def __init__(self, size: float) -> None:
        """Give the unknowns of a box of a size their numbers, and find the faces of its top near the places."""
        x, solid, faces = box(size)
        free = x[:, 2] > ON - HALF
        self.of_nodes = np.where(free[:, None], 3 * np.cumsum(free)[:, None] - 3 + np.arange(3), -1)
        self.of_domes = self.of_nodes.max() + 1 + np.arange(len(PLACES))
        distance = np.linalg.norm(x[faces[:3], :2].mean(axis=0)[:, None] - PLACES, axis=2)
        near = distance.min(axis=1) < NEAR
        self.faces, self.of_tip = faces[:, near], distance[near].argmin(axis=1)
        self.of_solid = self.of_nodes[solid.T].reshape(-1, 30)
        nodes = self.of_nodes[self.faces.T].reshape(-1, 18)
        self.of_faces = np.concatenate([nodes, self.of_domes[self.of_tip][:, None]], axis=1)
        self.pattern = Pattern(self.of_solid, self.of_faces, self.of_domes[:, None])


numbers_of = functools.lru_cache(maxsize=4)(Numbers)


class Pressed:
    """A sensor of four domes on a piece of a fruit, pressed farther and farther."""

    def __init__(self, sensor: SprungDomes, fruit: EllipsoidFruit, piece: Piece | None = None) -> None:
        """Bend the box to the fruit, and take slopes and volumes of its elements and of the faces near its places."""
        piece = piece or Piece()
        self.sensor, self.fruit, self.stand = sensor, fruit, Stand(sensor, fruit)
        self.springs = np.asarray(sensor.K) / fruit.E
        self.numbers = numbers_of(piece.size)
        x, self.solid, _ = box(piece.size)
        self.x = bent(x, fruit, piece, self.stand.feet)
        points, weights = get_quadrature(RefTet, 2)
        _, slopes = shapes(points, EDGES)
        jacobian = np.einsum("nek,nqd->eqkd", self.x[self.solid], slopes)
        self.slope = np.einsum("nqd,eqdk->eqnk", slopes, np.linalg.inv(jacobian))
        self.weight = np.linalg.det(jacobian) * weights
        assert self.weight.min() > 0.0
        points, weights = get_quadrature(RefTri, 6)
        self.on_face, slopes = shapes(points, EDGES[:3])
        tangents = np.einsum("nfk,nqd->fqkd", self.x[self.numbers.faces], slopes)
        self.area = np.linalg.norm(np.cross(tangents[..., 0], tangents[..., 1]), axis=-1) * weights
        self.found: list[tuple[float, Floats, Floats]] = []  # travels, unknowns and pressures
        self.factor: Any = None

    def contact(
        self, u: Floats, moved: Floats, place: Place, expected: Floats, penalty: float
    ) -> tuple[Floats, Floats, Floats]:
        """Return pressures at the points of faces, and by the dofs of each face and its dome forces and stiffness.

        `u` (n, 3) are displacements, `moved` (tips,) those of the domes along their axis. `expected` are the pressures
        where nothing penetrates, to which the penalty on the penetration is added.
        """
        axis, centres = place
        centres = centres + np.outer(moved, axis)
        faces = self.numbers.faces
        apart = np.einsum("nq,nfk->fqk", self.on_face, (self.x + u)[faces]) - centres[self.numbers.of_tip][:, None]
        distance = np.linalg.norm(apart, axis=-1)
        normal = apart / distance[..., None]
        pressure = np.maximum(expected + penalty * (self.sensor.dome_radius - distance), 0.0)
        both = normal[..., :, None] * normal[..., None, :]
        H = (penalty * self.area * (pressure > 0.0))[..., None, None] * both
        # how the normal turns, but where the skin is far inside a dome: this would leave no minimum
        turning = self.area * np.minimum(pressure, FIRMEST) / distance
        H -= turning[..., None, None] * (np.eye(3) - both)
        moves = self._moves(axis)
        forces = np.einsum("fqk,qkd->fd", -(self.area * pressure)[..., None] * normal, moves)
        return pressure, forces, np.einsum("qid,fqij,qje->fde", moves, H, moves, optimize=True)

    def _moves(self, axis: Floats) -> Floats:
        """Return slopes of the vector from a dome's centre to a point, over the dofs of a face and the dome's way.

        The way is up the axis (3,); the shape is (points, 3, 19).
        """
        moves = np.zeros((self.on_face.shape[1], 3, 19))
        for node, k in itertools.product(range(6), range(3)):
            moves[:, k, 3 * node + k] = self.on_face[node]
        moves[:, :, 18] = -axis
        return moves

    def balance(self, unknown: Floats, place: Place, expected: Floats, penalty: float) -> tuple[Floats, Any, Floats]:
        """Return the forces out of balance, their slope, and the pressures, at displacements of the nodes and domes."""
        numbers = self.numbers
        u = np.where(numbers.of_nodes < 0, 0.0, unknown[numbers.of_nodes])
        moved = unknown[numbers.of_domes]
        forces, stiffness = flesh(u, self.solid, self.slope, self.weight, self.fruit.poisson)
        pressure, pushes, stiffening = self.contact(u, moved, place, expected, penalty)
        pattern = numbers.pattern
        left = pattern.vector(numbers.of_solid, forces) + pattern.vector(numbers.of_faces, pushes)
        left += pattern.vector(numbers.of_domes, self.springs * moved)
        return left, pattern.matrix(stiffness, stiffening, self.springs), pressure

    def step(self, left: Floats, slope: Any) -> Floats:
        """Return Newton's step by conjugate gradients on the last factor, or on a new one where they are slow."""
        if self.factor is not None:
            before = LinearOperator(slope.shape, self.factor.solve)
            found, slow = cg(slope, -left, rtol=1e-2, maxiter=STEPS, M=before)
            if not slow:
                return found
        symmetric = {"SymmetricMode": True}
        self.factor = splu(slope, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, relax=1, options=symmetric)
        return self.factor.solve(-left)

    def forces(self, travel: float, changed_slope: Slope = (0.0, 0.0)) -> Floats:
        """Return the forces along the axis on the domes at a travel [mm] from the first touch, (tips,) [N].

        The start is extrapolated from the samples before; from far off, the penalty begins soft. Raises ArithmeticError
        where no balance is found.
        """
        place = self.stand.placed(travel, changed_slope)
        start = self.start(travel)
        try:
            unknown, pressure = self.balanced(place, start, FIRST[min(len(self.found), SETTLED) :])
        except ArithmeticError:  # too far from the last sample: softly, from where that one ended
            start = self.found[-1][1:] if self.found else start
            unknown, pressure = self.balanced(place, start, FIRST)
        self.found.append((travel, unknown, pressure))
        return self.fruit.E * self.springs * unknown[self.numbers.of_domes]

    def balanced(self, place: Place, start: State, passes: Sequence[tuple[float, float]]) -> State:
        """Return displacements and pressures in balance from others, by passes of a penalty and what it allows."""
        unknown, pressure = start
        for penalty, allowed in passes:
            expected = pressure
            for _ in range(STEPS):
                left, slope, pressure = self.balance(unknown, place, expected, penalty)
                if np.linalg.norm(left) < allowed * (self.springs * unknown[self.numbers.of_domes]).sum():
                    break
                unknown = unknown + self.step(left, slope)
            else:
                raise ArithmeticError(penalty)
        return unknown, pressure

    def start(self, travel: float) -> State:
        """Return the polynomials in the travel through the last displacements and pressures."""
        unknown, pressure = np.zeros(self.numbers.pattern.size), np.zeros_like(self.area)
        last = self.found[-SETTLED:]
        for x, *values in last:
            weight = np.prod([(travel - y) / (x - y) for y, *_ in last if y != x])
            unknown, pressure = unknown + weight * values[0], pressure + weight * values[1]
        return unknown, np.maximum(pressure, 0.0)


def rising_travels(sensor: SprungDomes, fruit: EllipsoidFruit, travel: float, samples: int = 10) -> Floats:
    """Return travels [mm] from a little after the last dome touches to the whole travel."""
    late = Stand(sensor, fruit).late.max()
    return np.linspace(late + 0.05 * (travel - late), travel, samples)


def press(
    sensor: SprungDomes,
    fruit: EllipsoidFruit,
    travels: Sequence[float] | Floats,
    piece: Piece | None = None,
    drift: Slope = (0.0, 0.0),
) -> Floats:
    """Return the forces of the domes at travels [mm] from the first touch, (samples, tips) [N].

    The slope of the sensor grows by `drift` [1] along x and y from the first touch to the last travel.
    """
    pressed = Pressed(sensor, fruit, piece)
    return np.array([pressed.forces(x, np.multiply(drift, x / travels[-1])) for x in travels])
