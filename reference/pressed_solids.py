"""Four rigid, frictionless domes on springs, pressed at finite strain on a piece of an ellipsoid, by tetrahedra.

The model contains no law of contact. The flesh is curved tetrahedra of second order, neo-Hookean in tensor form, and
the deflections of the springs are unknowns beside the nodes. Points on the skin are kept out of the spheres. Domes move
only along the axis of the sensor, and the sensor is pressed along it. Sensors and fruits come from `solve/presses`.

**One mesh for all presses.** The mesh is a box that is finest under four places. It consists of eight mirror images of
one part, so that it is equal under all domes. It is bent so that its top is the skin of the ellipsoid, and its places
are where the domes first touch. The base is flat and clamped, and the sides are free.

**One factorisation for many samples.** The pressure at a point of the skin is extrapolated from earlier samples. A soft
penalty on the penetration corrects it (augmented Lagrangian). Newton's steps are solved by conjugate gradients,
preconditioned by an old factorisation while it is good enough.

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
from solve.presses.pressed_bodies import EllipsoidFruit, SprungDomes
from solve.presses.pressing import Slope

Place = tuple[Floats, Floats]  # the axis up the sensor (3,), and the centres of the domes (tips, 3) [mm]
State = tuple[Floats, Floats]  # unknowns, and pressures at the points of the faces

MIRRORED = (1, 0, 2, 3, 4, 6, 5, 9, 8, 7)  # order of gmsh's nodes that makes a mirrored tetrahedron positive again
# Mirror images that make a box from an eighth of it: the order of the axes, and the signs of the coordinates.
IMAGES = (((1, 0, 2), (1.0, 1.0, 1.0)), ((0, 1, 2), (-1.0, 1.0, 1.0)), ((0, 1, 2), (1.0, -1.0, 1.0)))
HALF = 12.0  # half width of the box in plan, and its depth
FOOT = 2.3  # absolute x and y of the places
PLACES = FOOT * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])  # places in the order of the domes
ON = 1e-6  # tolerance of coordinates
UP = np.array([0.0, 0.0, 1.0])
SIZE = 0.65  # size of the elements under the places
REACH = 1.8  # distance from a place within which elements have this size
GROWTH = 0.4  # growth of the size per distance beyond
COARSEST = 4.0  # largest size of an element
NEAR = 3.5  # largest distance from a place at which the skin may touch
PENALTY = 100.0  # pressure over penetration
FIRST = ((0.1 * PENALTY, 1e-2), (PENALTY, 1e-3), (PENALTY, 1e-3), (PENALTY, 3e-4))
"""Passes for a first sample: penalties, each with the allowed residual over the sum of the spring forces."""
SETTLED = 3  # samples that are extrapolated; after as many, the last pass is enough
FIRMEST = 0.5  # pressure over E, larger than any that occurs
STEPS = 40  # most Newton steps of a pass, and most steps of conjugate gradients


@dataclass(frozen=True, kw_only=True)
class Piece:
    """A piece of fruit around its apex: the side of its plan, the thickness of flesh over a rigid stone [mm].

    `size` [mm] is the size of the elements under the places.
    """

    plan: float = 24.0
    thickness: float = 12.0
    size: float = SIZE


def rise_of_skin(fruit: EllipsoidFruit, x: Floats, y: Floats) -> Floats:
    """Return the height of the ellipsoid above the tangent plane at its apex [mm], at most 0."""
    angle = np.radians(fruit.azimuth)
    along = x * np.cos(angle) + y * np.sin(angle)
    across = y * np.cos(angle) - x * np.sin(angle)
    return fruit.R1 * (np.sqrt(1.0 - (along / fruit.R1) ** 2 - across**2 / (fruit.R1 * fruit.R2)) - 1.0)


class Stand:
    """The pose of a sensor on a fruit whose apex is the origin, with z up.

    `feet` (tips, 2) [mm] are x and y of the first touch of each dome, and `late` (tips,) [mm] the travel of the sensor
    at that touch.
    """

    def __init__(self, sensor: SprungDomes, fruit: EllipsoidFruit) -> None:
        """Find the first touch of each dome by minimising its distance to the skin along the axis."""
        self.sensor, self.fruit = sensor, fruit
        self.first = 0.0
        axis, centres = self.placed(0.0)

        def room(place: Floats, centre: Floats) -> float:
            """Return the distance that a dome can move down its axis until it meets the skin at a place [mm]."""
            beside = centre - [*place, rise_of_skin(fruit, *place)]
            along = beside @ axis
            return along - np.sqrt(sensor.dome_radius**2 - beside @ beside + along**2)

        found = [minimize(room, centre[:2], (centre,), tol=1e-10) for centre in centres]
        self.feet = np.array([one.x for one in found])
        self.first = min(one.fun for one in found)
        self.late = np.array([one.fun - self.first for one in found])

    def placed(self, travel: float, changed_slope: Slope = (0.0, 0.0)) -> Place:
        """Return the upward axis of the sensor (3,) and the centres of the domes (tips, 3) [mm] on unloaded springs.

        `travel` [mm] is measured from the first touch; `changed_slope` [1] is added to the slope of the sensor.
        """
        slope = np.append(self.fruit.slope + changed_slope, 1.0)
        axis = slope / np.linalg.norm(slope)
        level = np.eye(2, 3) - np.outer(axis[:2], axis + UP) / (1.0 + axis[2])  # least rotation
        up = self.sensor.dome_radius - self.first - travel - np.broadcast_to(self.fruit.heights, len(self.sensor.K))
        return axis, self.sensor.positions @ level - np.append(self.fruit.apex, 0.0) + np.outer(up, axis)


@functools.lru_cache(maxsize=4)
def box(size: float) -> tuple[Floats, Ints, Ints]:
    """Return nodes (n, 3), tetrahedra (10, m) and faces of the top (6, k) of the box, for a size under the places.

    An eighth of the box is meshed. Each of three mirror images doubles the part.
    """

    def wanted(_dimension: int, _tag: int, x: float, y: float, z: float, _size: float) -> float:  # gmsh's call
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
        # Nodes on the mirror plane are their own images, so points that agree to six decimals are merged.
        both = np.concatenate([x, x[:, order] * signs])
        _, kept, same = np.unique(both.round(6), axis=0, return_index=True, return_inverse=True)
        solid = same[np.concatenate([solid, solid[MIRRORED, :] + len(x)], axis=1)]
        faces = same[np.concatenate([faces, faces + len(x)], axis=1)]
        x = both[kept]
    return x, solid, faces


def bent(x: Floats, fruit: EllipsoidFruit, piece: Piece, feet: Floats) -> Floats:
    """Return the nodes (n, 3) [mm] of a box, bent to a piece of a fruit with its places at `feet` (4, 2).

    The plan is stretched to the plan of the piece, the places are moved to the feet, and columns end at the skin.
    """
    plan = x[:, :2] * (1.0 + (0.5 * piece.plan / HALF - 1.0) * (x[:, :2] / HALF) ** 2)
    inside = np.prod((1.0 - (x[:, :2] / HALF) ** 2) / (1.0 - (FOOT / HALF) ** 2), axis=1)
    for place, foot in zip(PLACES, feet, strict=True):
        plan += np.outer(inside * np.prod(0.5 * (1.0 + x[:, :2] / place), axis=1), foot - place)
    deep = -x[:, 2] + (piece.thickness - HALF) * (x[:, 2] / HALF) ** 2  # sizes near the skin do not change
    rise = rise_of_skin(fruit, *plan.T)
    return np.column_stack([plan, rise - deep * (1.0 + rise / piece.thickness)])


class Pattern:
    """The places of the entries of element matrices (m, n, n) in one sparse matrix, found once for many assemblies.

    Elements of one kind have dofs (m, n); a dof of -1 is held.
    """

    def __init__(self, *dofs: Ints) -> None:
        """Find the place of each element entry among the entries of the matrix, column by column."""
        self.size = 1 + max(each.max() for each in dofs)
        found = []
        for each in dofs:
            rows, columns = each[:, :, None], each[:, None, :]
            # All entries of held dofs go to one place beyond the end, which is dropped.
            found.append(np.where((rows < 0) | (columns < 0), self.size**2, columns * self.size + rows).ravel())
        keys, self.entry = np.unique(np.concatenate(found), return_inverse=True)
        self.count = np.searchsorted(keys, self.size**2)
        columns, self.rows = np.divmod(keys[: self.count], self.size)
        self.starts = np.searchsorted(columns, np.arange(self.size + 1))

    def matrix(self, *entries: Floats) -> Any:
        """Return the assembled matrix; kinds of elements are in the order in which their dofs were given."""
        values = np.bincount(self.entry, np.concatenate([each.ravel() for each in entries]), self.count + 1)
        return csc_matrix((values[: self.count], self.rows, self.starts), shape=(self.size, self.size))

    def vector(self, dofs: Ints, entries: Floats) -> Floats:
        """Return the assembled vector of element vectors; `dofs` and `entries` are (m, n)."""
        return np.bincount(dofs.ravel() + 1, entries.ravel(), self.size + 1)[1:].astype(np.float64, copy=False)


class Numbers:
    """The unknowns of a box under four domes: displacements of free nodes, then deflections of the domes."""

    def __init__(self, size: float) -> None:
        """Assign numbers to the unknowns of the box, and find the faces of its top that a dome may touch."""
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
    """A sensor with four domes that is pressed on a piece of fruit, travel by travel."""

    def __init__(self, sensor: SprungDomes, fruit: EllipsoidFruit, piece: Piece | None = None) -> None:
        """Bend the box to the fruit, and compute gradients and volumes of its elements, and areas of the touched faces.

        The slopes are gradients of shape functions at quadrature points.
        """
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
        """Return pressures at the points of faces, and the forces and stiffness for the dofs of each face and its dome.

        `u` (n, 3) are displacements of nodes, `moved` (tips,) deflections of domes along the axis. The pressure is
        `expected` plus the penalty times the penetration, or 0 if this is negative.
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
        # The rotation of the normal makes the stiffness smaller. It is limited, because a large one far inside a dome
        # would make the stiffness indefinite.
        turning = self.area * np.minimum(pressure, FIRMEST) / distance
        H -= turning[..., None, None] * (np.eye(3) - both)
        moves = self._moves(axis)
        forces = np.einsum("fqk,qkd->fd", -(self.area * pressure)[..., None] * normal, moves)
        return pressure, forces, np.einsum("qid,fqij,qje->fde", moves, H, moves, optimize=True)

    def _moves(self, axis: Floats) -> Floats:
        """Return the derivatives of the vector from the centre of a dome to a point of a face, (points, 3, 19).

        The 19 dofs are the displacements of six nodes, and the deflection of the dome up the axis (3,).
        """
        moves = np.zeros((self.on_face.shape[1], 3, 19))
        for node, k in itertools.product(range(6), range(3)):
            moves[:, k, 3 * node + k] = self.on_face[node]
        moves[:, :, 18] = -axis
        return moves

    def balance(self, unknown: Floats, place: Place, expected: Floats, penalty: float) -> tuple[Floats, Any, Floats]:
        """Return the residual forces, their derivative, and the pressures for given unknowns."""
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
        """Return Newton's step, by conjugate gradients preconditioned with the last factorisation.

        If they converge too slowly, the matrix is factorised again, and the step is exact.
        """
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

        The start is extrapolated from earlier samples. If it is too far from equilibrium, a softer penalty is tried
        first. Raises ArithmeticError if no equilibrium is found.
        """
        place = self.stand.placed(travel, changed_slope)
        start = self.start(travel)
        try:
            unknown, pressure = self.balanced(place, start, FIRST[min(len(self.found), SETTLED) :])
        except ArithmeticError:  # start again from the last sample, with all passes
            start = self.found[-1][1:] if self.found else start
            unknown, pressure = self.balanced(place, start, FIRST)
        self.found.append((travel, unknown, pressure))
        return self.fruit.E * self.springs * unknown[self.numbers.of_domes]

    def balanced(self, place: Place, start: State, passes: Sequence[tuple[float, float]]) -> State:
        """Return unknowns and pressures in equilibrium from a start.

        Each pass is a penalty with its allowed residual, over the sum of the spring forces. It uses the pressures of
        the pass before as expected ones. Raises ArithmeticError if a pass does not converge.
        """
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
        """Return unknowns and pressures at a travel [mm], extrapolated by polynomials through the last samples."""
        unknown, pressure = np.zeros(self.numbers.pattern.size), np.zeros_like(self.area)
        last = self.found[-SETTLED:]
        for x, *values in last:
            weight = np.prod([(travel - y) / (x - y) for y, *_ in last if y != x])
            unknown, pressure = unknown + weight * values[0], pressure + weight * values[1]
        return unknown, np.maximum(pressure, 0.0)


def rising_travels(sensor: SprungDomes, fruit: EllipsoidFruit, travel: float, samples: int = 10) -> Floats:
    """Return evenly spaced travels [mm], from shortly after the touch of the last dome to the full travel."""
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
