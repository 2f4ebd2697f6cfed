"""Four rigid, slippery balls on springs in a piece of a ball of flesh at finite strain, by tetrahedra in space.

Nothing of a law of contact is in them. They have curved tetrahedra of second order, neo-Hooke in the tensor form, and
springs as unknowns beside the nodes. The skin is held out of the balls themselves by a penalty at points of its faces.
A plane of symmetry runs through two balls that stand across from each other; a level press has a second one. Lengths in
mm, E = 1.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import gmsh
import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import LinearOperator, cg, splu
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTet, RefTri

from mesh.session import element_nodes, gmsh_session, used_nodes
from sensor.arrays import Floats, Ints

EDGES = ((0, 1), (1, 2), (2, 0), (3, 0), (2, 3), (1, 3))  # of the nodes 4 to 9 of a tetrahedron of gmsh
ON = 1e-6  # [mm]
REACH = 1.5  # from where a ball meets the skin, within which the mesh is finest
GROWTH = 0.3  # of the size over the distance beyond
COARSEST = 3.0
PENALTIES = (10.0, 100.0, 600.0, 3000.0)  # pressure over penetration, one after the other
BALANCED = 1e-5  # forces out of balance over those of the springs
STEPS = 40  # at most, of Newton's method for a penalty and of conjugate gradients for a step


@dataclass(frozen=True, kw_only=True)
class Press:
    """Balls at the corners of a square on a piece of a ball: E of the flesh in MPa, stiffness of the springs in N/mm.

    The first axis runs through two balls that stand across from each other, on springs `K[0]`; the others stand on
    `K[1]`. `tilt_deg` lowers the ball on the positive side of that axis, `off_centre` moves all of them along it.
    """

    E: float
    K: tuple[float, float]
    travel: float = 0.5
    tilt_deg: float = 0.0
    off_centre: float = 0.0
    radius: float = 35.0
    ball: float = 10.0
    side: float = 6.0
    plan: float = 24.0
    thickness: float = 12.0
    poisson: float = 0.3

    @property
    def level(self) -> bool:
        """Say whether the press is level and in the middle: a second plane of symmetry halves it."""
        return self.tilt_deg == 0.0 and self.off_centre == 0.0

    @property
    def axis(self) -> Floats:
        """Return the axis of the sensor, upwards (3,)."""
        tilt = np.radians(self.tilt_deg)
        return np.array([np.sin(tilt), 0.0, np.cos(tilt)])

    @property
    def middle(self) -> Floats:
        """Return the centre of the ball of flesh (3,); its apex is the origin."""
        return np.array([0.0, 0.0, -self.radius])

    def balls(self) -> tuple[Floats, Floats, Floats]:
        """Return the centres (n, 3) of balls where a level sensor first touches, their springs, and their solved parts.

        Only balls on the solved side of the planes of symmetry are among them; the part of one on a plane is a half.
        """
        reach = self.side * np.sqrt(0.5)
        away = (abs(self.off_centre - reach), abs(self.off_centre + reach), np.hypot(self.off_centre, reach))
        both = self.radius + self.ball
        fall = both - np.sqrt(both**2 - min(away) ** 2)
        along = np.array([self.axis[2], 0.0, -self.axis[0]])
        places = np.stack([reach * along, [0.0, reach, 0.0], -reach * along])
        centres = places + self.ball * self.axis + [self.off_centre, 0.0, -fall]
        springs = np.array([self.K[0], self.K[1], self.K[0]])
        if self.level:
            return centres[:2], springs[:2], np.array([0.5, 0.5])
        return centres, springs, np.array([0.5, 1.0, 0.5])

    def feet(self) -> Floats:
        """Return where the balls that are solved meet the skin."""
        away = self.balls()[0] - self.middle
        return self.middle + self.radius * away / np.linalg.norm(away, axis=1)[:, None]


def tetrahedra(press: Press, size: float) -> tuple[Floats, Ints, Ints]:
    """Return the nodes (n, 3), the tetrahedra (10, m) and the faces of the skin (6, k), of a size under the balls.

    The solid is a ball, cut to the box of the piece and to the solved side of the planes of symmetry.
    """
    feet = press.feet()
    half = 0.5 * press.plan
    far = 4.0 * half

    def wanted(_dimension: int, _tag: int, x: float, y: float, z: float, _size: float) -> float:  # as gmsh calls it
        distance = np.linalg.norm(feet - [x, y, z], axis=1).min()
        return min(size + GROWTH * max(0.0, distance - REACH), COARSEST)

    with gmsh_session():
        occ = gmsh.model.occ
        ball = (3, occ.addSphere(*press.middle, press.radius))
        occ.rotate([ball], *press.middle, 1.0, 0.0, 0.0, 0.5 * np.pi)  # its poles away from the top
        box = (3, occ.addBox(-half, -half, -press.thickness, 2.0 * half, 2.0 * half, press.thickness))
        occ.rotate([box], 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.25 * np.pi)
        left = 0.0 if press.level else -far
        solved = (3, occ.addBox(left, 0.0, -far, far - left, far, 2.0 * far))
        piece, _ = occ.intersect([ball], [box])
        occ.intersect(piece, [solved])
        occ.synchronize()
        gmsh.model.mesh.setSizeCallback(wanted)
        gmsh.option.setNumber("Mesh.ElementOrder", 2.0)
        gmsh.model.mesh.generate(3)
        solid = element_nodes("Tetrahedron", 2)
        faces = element_nodes("Triangle", 2)
        nodes = used_nodes(solid)
    x = nodes.points.T
    faces = nodes.index[faces]
    on_skin = np.abs(np.linalg.norm(x - press.middle, axis=1) - press.radius) < ON
    return x, nodes.index[solid], faces[:, on_skin[faces].all(axis=0)]


def shapes(points: Floats, edges: Sequence[tuple[int, int]]) -> tuple[Floats, Floats]:
    """Return the functions of second order of a simplex and their slopes, (nodes, points) and (nodes, points, dim)."""
    dim, count = points.shape
    corners = np.concatenate([1.0 - points.sum(axis=0, keepdims=True), points])
    steep = np.concatenate([-np.ones((1, dim)), np.eye(dim)])[:, None] * np.ones((count, 1))
    values = [corner * (2.0 * corner - 1.0) for corner in corners]
    slopes = [(4.0 * corner - 1.0)[:, None] * slope for corner, slope in zip(corners, steep, strict=True)]
    for i, j in edges:
        values.append(4.0 * corners[i] * corners[j])
        slopes.append(4.0 * (corners[i][:, None] * steep[j] + corners[j][:, None] * steep[i]))
    return np.array(values), np.array(slopes)


def flesh(u: Floats, solid: Ints, slope: Floats, weight: Floats, poisson: float) -> tuple[Floats, Floats]:
    """Return the forces at the nodes of neo-Hookean elements and their stiffness, (m, 30) and (m, 30, 30), E = 1.

    `u` (n, 3) are displacements, `solid` (10, m) the elements. At their points they have slopes of their functions
    `slope` (m, points, 10, 3) and volumes `weight` (m, points). Raises ArithmeticError where one is turned inside out.
    """
    mu = 0.5 / (1.0 + poisson)
    lam = poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson))
    # indices: node n, element e, point q, component k, axis d
    F = np.eye(3) + np.einsum("nek,eqnd->eqkd", u[solid], slope)
    J = np.linalg.det(F)
    if J.min() <= 0.0:
        raise ArithmeticError(J.min())
    log = np.log(J)
    now = slope @ np.linalg.inv(F)  # slopes over the places where the flesh is now
    P = mu * slope @ F.swapaxes(-1, -2) + (lam * log - mu)[..., None, None] * now
    forces = np.einsum("eq,eqni->eni", weight, P).reshape(-1, 30)
    flat = now.reshape(*J.shape, 30)
    swelling = (flat * (lam * weight)[..., None]).swapaxes(1, 2) @ flat
    turning = (flat * ((mu - lam * log) * weight)[..., None]).swapaxes(1, 2) @ flat
    K = swelling.reshape(-1, 10, 3, 10, 3) + turning.reshape(-1, 10, 3, 10, 3).transpose(0, 1, 4, 3, 2)
    K[:, :, range(3), :, range(3)] += np.einsum("eq,eqnk,eqmk->enm", mu * weight, slope, slope)
    return forces, K.reshape(-1, 30, 30)


class Pressed:
    """A piece of flesh under balls: unknowns are the displacements of its nodes and of the balls up their axis.

    `slope` and `weight` are those of the elements as `flesh` takes them. At the points of the faces of the skin near
    balls, `on_face` (6, points) are shape functions and `area` (k, points) weights. `of_ball` (k,) is the nearest ball.
    """

    def __init__(self, press: Press, size: float) -> None:
        """Mesh the piece and find its faces near balls and what is held."""
        self.press = press
        self.x, self.solid, faces = tetrahedra(press, size)
        points, weights = get_quadrature(RefTet, 2)
        _, slopes = shapes(points, EDGES)
        jacobian = np.einsum("nek,nqd->eqkd", self.x[self.solid], slopes)
        self.slope = np.einsum("nqd,eqdk->eqnk", slopes, np.linalg.inv(jacobian))
        self.weight = np.linalg.det(jacobian) * weights
        self.dofs = (3 * self.solid.T[:, :, None] + np.arange(3)).reshape(-1, 30)

        self.centres, springs, self.part = press.balls()
        self.springs = self.part * springs / press.E
        self._set_faces(faces)

        held = np.zeros(self.x.shape, dtype=bool)
        held[np.abs(self.x[:, 2] + press.thickness) < ON] = True
        held[np.abs(self.x[:, 1]) < ON, 1] = True
        if press.level:
            held[np.abs(self.x[:, 0]) < ON, 0] = True
        self.free = np.flatnonzero(np.append(~held.ravel(), np.ones(len(springs), dtype=bool)))
        self.factor: Any = None

    def _set_faces(self, faces: Ints) -> None:
        """Keep the faces of the skin (6, k) that are near a ball, with their quadrature and their dofs."""
        distance = np.linalg.norm(self.x[faces[:3]].mean(axis=0)[:, None] - self.press.feet(), axis=2)
        near = distance.min(axis=1) < 2.0 * REACH
        self.faces = faces[:, near]
        self.of_ball = distance[near].argmin(axis=1)
        points, weights = get_quadrature(RefTri, 6)
        self.on_face, slopes = shapes(points, EDGES[:3])
        tangents = np.einsum("nfk,nqd->fqkd", self.x[self.faces], slopes)
        self.area = np.linalg.norm(np.cross(tangents[..., 0], tangents[..., 1]), axis=-1) * weights
        of_nodes = (3 * self.faces.T[:, :, None] + np.arange(3)).reshape(-1, 18)
        self.face_dofs = np.concatenate([of_nodes, self.x.size + self.of_ball[:, None]], axis=1)
        # Slopes of the vector from a ball's centre to a point over the dofs of a face and the ball's way up its axis.
        self.apart = np.zeros((len(weights), 3, 19))
        for node, k in itertools.product(range(6), range(3)):
            self.apart[:, k, 3 * node + k] = self.on_face[node]
        self.apart[:, :, 18] = -self.press.axis

    def contact(self, u: Floats, moved: Floats, penalty: float) -> tuple[Floats, Floats]:
        """Return the forces of faces and their stiffness, by the dofs of each and its ball: (k, 19), (k, 19, 19)."""
        centres = self.centres - [0.0, 0.0, self.press.travel] + moved[:, None] * self.press.axis
        apart = np.einsum("nq,nfk->fqk", self.on_face, (self.x + u)[self.faces]) - centres[self.of_ball][:, None]
        distance = np.linalg.norm(apart, axis=-1)
        normal = apart / distance[..., None]
        entered = np.maximum(self.press.ball - distance, 0.0)
        push = penalty * self.area * entered
        both = normal[..., :, None] * normal[..., None, :]
        H = (penalty * self.area * (entered > 0.0))[..., None, None] * both
        if penalty == PENALTIES[-1]:  # before, penetration is deep, and this would leave no minimum
            H -= (push / distance)[..., None, None] * (np.eye(3) - both)
        forces = np.einsum("fqk,qkd->fd", -push[..., None] * normal, self.apart)
        return forces, np.einsum("qid,fqij,qje->fde", self.apart, H, self.apart, optimize=True)

    def balance(self, unknown: Floats, penalty: float) -> tuple[Floats, Any]:
        """Return the forces out of balance and their slope, on the free unknowns, at displacements of all."""
        u = unknown[: self.x.size].reshape(-1, 3)
        moved = unknown[self.x.size :]
        shape = (len(unknown), len(unknown))
        own = np.append(np.zeros(self.x.size), self.springs)
        left = own * unknown
        slope: Any = coo_matrix((self.springs, (np.flatnonzero(own),) * 2), shape=shape).tocsc()
        solid = flesh(u, self.solid, self.slope, self.weight, self.press.poisson)
        parts = ((self.dofs, *solid), (self.face_dofs, *self.contact(u, moved, penalty)))
        for dofs, forces, stiffness in parts:
            left += np.bincount(dofs.ravel(), forces.ravel(), len(left))
            rows = np.repeat(dofs, dofs.shape[1], axis=1).ravel()
            columns = np.tile(dofs, (1, dofs.shape[1])).ravel()
            slope += coo_matrix((stiffness.ravel(), (rows, columns)), shape=shape).tocsc()
        return left[self.free], slope[self.free][:, self.free]

    def step(self, left: Floats, slope: Any) -> Floats:
        """Return Newton's step by conjugate gradients on the last factor, or on a new one where they are slow."""
        if self.factor is not None:
            before = LinearOperator(slope.shape, self.factor.solve)
            found, slow = cg(slope, -left, rtol=1e-3, maxiter=STEPS, M=before)
            if not slow:
                return found
        self.factor = splu(slope, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        return self.factor.solve(-left)

    def forces(self) -> Floats:
        """Return the forces along the axis on the balls that are solved, whole ones [N].

        Each penalty starts from the balance of a softer one; only the last must be balanced well.
        """
        unknown = np.zeros(self.x.size + len(self.springs))
        for penalty in PENALTIES:
            balanced = BALANCED if penalty == PENALTIES[-1] else 1e3 * BALANCED
            for _ in range(STEPS):
                left, slope = self.balance(unknown, penalty)
                carried = self.springs * unknown[self.x.size :]
                if np.linalg.norm(left) < balanced * carried.sum():
                    break
                unknown[self.free] += self.step(left, slope)
            else:
                raise ArithmeticError(penalty)
        return self.press.E * carried / self.part


def extrapolated_forces(press: Press, sizes: tuple[float, float] = (0.6, 0.4)) -> Floats:
    """Return the forces of the balls that are solved, from two meshes: the error goes with the square of the size."""
    coarse, fine = (Pressed(press, size).forces() for size in sizes)
    return fine + (fine - coarse) / ((sizes[0] / sizes[1]) ** 2 - 1.0)
