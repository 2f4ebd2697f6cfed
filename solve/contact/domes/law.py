"""Forces of domes on springs in closed form: each presses as Hertz's sphere, and all feel each other and the body.

A dome that is pressed by q [mm] along the normal beyond what the others and the body give way carries

    N = 4/3 g E* sqrt(R) q^(3/2),    E* = E / (1 - nu^2),    1 / R = 1 / r + 1 / R_fruit,

K. L. Johnson, Contact Mechanics (1985), equation (4.23), doi:10.1017/CBO9781139171731, with g by large strain
(`large_strain.py`). Its interference b, what it would enter the undeformed fruit on its spring as it stands, is

    b_i = q_i + sum_j (B_ij + k_ij) N_j / E,
    k_ij = (1 - nu^2) / (pi p) (1 + a_i^2 / (6 p^2) + a_j^2 / (10 p^2)),

with p the distance of two contacts, a their radii, and B what the body adds to a half-space, along the normals where
the domes touch. The second moments are those of the pressures: of Hertz where a force acts, of its increment, the flat
punch, where it is felt. The slope that the others make under a dome moves its contact by R times that slope. The force
along the spring is N times the cosine of the normal to the axis. What leans moves the dome sideways, as far as the
housing gives. A dome that is off has q <= 0 and no force: one smooth system, solved by Newton's method. Friction is not
in it. The flesh is neo-Hookean; other laws are told apart. Under a skin N is that of a layered half-space at small
strain (`solve/halfspace/layered.py`). All that large strain does to bare flesh is in the error bar.
"""

from dataclasses import dataclass, replace

import numpy as np

from sensor.arrays import Floats, Ints
from solve.contact.domes.body import FruitUnderDomes, dome_body
from solve.contact.domes.geometry import DomeApproach, DomePoses, dome_poses
from solve.contact.domes.large_strain import LargeStrain, large_strain
from solve.contact.domes.sphere import sphere_contact_radius
from solve.contact.scene import Scene, SidewaysGive
from solve.fruit.compliance import FruitCompliance
from solve.halfspace.layered import RoundContact
from solve.linear import SolveError

# Half the mean of x^2 less that of y^2 / 2 under the flat punch and under Hertz's pressure [contact radii^2].
FELT = 1.0 / 6.0
ACTING = 1.0 / 10.0
MOST_STEPS = 60  # of Newton's method
STEPS_ALONE = 5  # of the same for each dome alone, where it starts
HALVINGS = 12  # of a step
# Of what the body adds to a half-space, by how much it changes where the domes touch elsewhere than it was solved, per
# growth of the square of their way from the middle over the square of its size. tests/reference/fits/test_contact.py
ELSEWHERE = 2.0
# Fractions of terms that are left out or not known better: the body's deflection changes over a contact by
# (a / size)^2, crosstalk by the next power of its moments; the rest is a fraction of the depth:
# tests/reference/fits as well.
OVER_CONTACT = 0.25
NEXT_MOMENT = 0.5
OF_DEPTH = 7e-4
RESIDUAL_LIMIT = 1e-12  # of the largest coordinate of a dome, where round-off on the fruit allows it
# Of the largest semi-axis, as domes meet the fruit at places counted from its centre: 3 epsilon are seen.
ROUND_OFF = 10.0 * float(np.finfo(np.float64).eps)


@dataclass(frozen=True, eq=False)
class DomeForces:
    """Forces F of the domes along their springs [N], (poses, tips), and what they do, each as F.

    `rates` [N/mm] are their slopes over the travel, `error` [N] how far each may be off in neo-Hookean flesh.
    `error_alike` [N] is how far all are off together where the error has one sign under all domes, as where the fruit
    sinks otherwise. `flesh` [N] is what Hencky's law adds and that of Storakers takes. `contact_radius` [mm] and
    `mean_pressure` [MPa] are those of the contacts as they are pressed. `pressure_error` [1] is how far the latter may
    be off by the edge of the contact alone. `face` [mm] is the width of a face that would hold each.
    """

    F: Floats
    rates: Floats
    error: Floats
    error_alike: Floats
    flesh: Floats
    contact_radius: Floats
    mean_pressure: Floats
    pressure_error: Floats
    face: Floats

    @property
    def relative_error(self) -> Floats:
        """Return the relative error of each force above 0 [1], (poses, tips)."""
        touching = self.F > 0.0
        return np.where(touching, self.error / np.where(touching, self.F, 1.0), 0.0)


@dataclass(frozen=True, eq=False)
class _DomeState:
    """Domes at trial depths q [mm], each (poses, tips) but for `approach`, `strain` and `action`.

    `N` [N] are the normal forces, `stiffness` [N/mm] their slopes over q, `contact_radius` [mm] those of Hertz.
    `action` (poses, tips, tips) is k_ij of the module's first lines, times E [1/mm]; `residual` [mm] is what its second
    equation misses.
    """

    approach: DomeApproach
    N: Floats
    stiffness: Floats
    contact_radius: Floats
    strain: LargeStrain
    action: Floats
    residual: Floats
    q: Floats


def dome_forces(poses: DomePoses, E: Floats, C: Floats, body: FruitUnderDomes) -> DomeForces:
    """Return the forces of domes at moduli E (poses,) [MPa] on springs of compliance C (tips, tips) [mm/N].

    `body` is what the fruit adds to a half-space, in the same poses. Raises SolveError where the forces do not settle.
    """
    law = _Law(poses, E, C, body)
    state = law.equilibrium()
    cosine = state.approach.cosine
    touching = state.N > 0.0
    contact_radius = state.contact_radius * state.strain.edge
    # Slope of the force along spring i over the interference of dome j [N/mm].
    gain = (cosine * state.stiffness)[..., None] * np.linalg.inv(law.jacobian(state))
    bound = law.bound(state)
    flesh = law.depth_change(state, state.strain.law_spread)
    face = 2.0 * (poses.from_face_middle(state.approach) + law.rim_radius(state))
    return DomeForces(
        F=cosine * state.N,
        rates=np.where(touching, np.einsum("pij,pj->pi", gain, state.approach.normal[..., 2]), 0.0),
        error=np.einsum("pij,pj->pi", np.abs(gain), bound),
        error_alike=np.einsum("pij,pj->pi", gain, bound),
        flesh=np.einsum("pij,pj->pi", gain, flesh),
        contact_radius=contact_radius,
        mean_pressure=state.N / np.where(touching, np.pi * contact_radius**2, 1.0),
        pressure_error=np.where(touching, 2.0 * state.strain.edge_error, 0.0),
        face=np.where(touching, face, 0.0),
    )


@dataclass(frozen=True, eq=False)
class DomeContrast:
    """What the contrast of forces along the springs needs to know of level domes (`sensor/theory/contrast_law.py`).

    `S` (tips, tips), times E [1/mm], is the compliance but for Hertz's part. `hertz` [mm (MPa/N)^(2/3)] is h of h (F /
    E)^(2/3), the mean over the tips. `lean` (tips, tips) [mm/N] is what leaning forces add to the compliance of the
    springs. They move the tips sideways on the slope of the fruit.
    """

    S: Floats
    hertz: float
    lean: Floats


def dome_contrast(scene: Scene, compliance: FruitCompliance, C: Floats, E: float) -> DomeContrast:
    """Return the constants of domes for the contrast law, at a level press at modulus E [MPa] over the full travel.

    C (tips, tips) [mm/N] is the compliance of the springs. Forces along normals are turned into forces along the
    springs by the cosines of their angles. Raises SolveError where the forces do not settle, and where a dome is off
    the fruit: its part in the contrast is unknown.
    """
    level = replace(scene, press=replace(scene.press, tilt_deg=0.0, roll_deg=0.0), off_centre_mm=(0.0, 0.0))
    body = dome_body(scene, compliance, [scene.fruit])
    law = _Law(dome_poses([level], np.array([scene.press.travel_mm])), np.array([E]), C, body)
    state = law.equilibrium()
    off = int((state.N[0] <= 0.0).sum())
    if off:
        hint = "press deeper, or take stiffer springs or a softer skin"
        msg = f"domes: {off} of {len(C)} are off the fruit at full travel of a level press: must be none; {hint}"
        raise SolveError(msg)
    cosine = state.approach.cosine[0]
    hertz = state.q[0] / cosine * (E / (cosine * state.N[0])) ** (2.0 / 3.0)
    return DomeContrast(
        S=(body.remainder + state.action)[0] / np.outer(cosine, cosine),
        hertz=float(np.mean(hertz)),
        lean=law.normal_compliance(state.approach)[0] / np.outer(cosine, cosine) - C,
    )


class _Law:
    """The equations of the domes for the depths q (poses, tips) [mm], negative where a dome is off."""

    def __init__(self, poses: DomePoses, E: Floats, C: Floats, body: FruitUnderDomes) -> None:
        """Take the domes, moduli E (poses,) [MPa], the springs C (tips, tips) [mm/N] and the body."""
        self._poses = poses
        sideways = poses.sideways or SidewaysGive(np.zeros((*C.shape, 3, 3)), 0.0)
        self._springs = C
        self._C = sideways.compliance.copy()  # (tips, tips, 3, 3) [mm/N], in the frame of the sensor
        self._C[..., 2, 2] += C
        self._sideways_error = sideways.error
        self._body = body
        self._E = E[:, None]
        self._point_load = (1.0 - body.poisson**2) / np.pi  # deflection times distance, E and over the force [1]

    def equilibrium(self) -> _DomeState:
        """Return the domes as they rest; raises SolveError where Newton's method with halved steps does not settle."""
        unmoved = self._poses.approach(np.zeros(self._poses.centres.shape))
        state = self.state(self._depths_alone(unmoved), unmoved)
        allowed = self._allowed_residual()
        for _ in range(MOST_STEPS):
            if np.abs(state.residual).max(initial=0.0) <= allowed:
                return state
            worst = np.maximum(np.abs(state.residual).max(axis=1), allowed)
            step = np.linalg.solve(self.jacobian(state), state.residual[..., None])[..., 0]
            trial = self.state(state.q + step, state.approach)
            grown = np.flatnonzero(np.abs(trial.residual).max(axis=1) > worst)
            state = self._halved(state, np.asarray(step), grown, worst) if grown.size else trial
        residual = np.abs(state.residual).max()
        hint = "press less deep, or take stiffer springs"
        msg = f"domes: residual {residual:.1e} mm must be at most {allowed:.0e} mm; {hint}"
        raise SolveError(msg)

    def _allowed_residual(self) -> float:
        """Return the residual at which domes have settled [mm], above the round-off of where they meet the fruit."""
        semi_axes = self._poses.semi_axes
        round_off = ROUND_OFF * semi_axes.max(initial=0.0, where=np.isfinite(semi_axes))
        return max(RESIDUAL_LIMIT * float(np.abs(self._poses.centres).max()), float(round_off))

    def _depths_alone(self, unmoved: DomeApproach) -> Floats:
        """Return about how deep each dome stands on its own spring, without the others and the body [mm].

        Newton's method starts at the undeformed fruit and comes down to the answer without overshooting: the force
        grows ever faster with the depth.
        """
        compliance = np.einsum("pii->pi", self.normal_compliance(unmoved))
        q = unmoved.interference
        for _ in range(STEPS_ALONE):
            N, stiffness, _, _ = self._hertz(q, unmoved)
            q = q - (q + compliance * N - unmoved.interference) / (1.0 + compliance * stiffness)
        return np.asarray(q)

    def _halved(self, state: _DomeState, step: Floats, grown: Ints, worst: Floats) -> _DomeState:
        """Return the state after steps (poses, tips) [mm], those of `grown` poses halved until none exceeds `worst`."""
        for _ in range(HALVINGS):
            step[grown] *= 0.5
            few = _Law(self._poses.select(grown), self._E[grown, 0], self._springs, self._body.select(grown))
            trial = few.state(state.q[grown] + step[grown], state.approach.select(grown))
            grown = grown[np.abs(trial.residual).max(axis=1) > worst[grown]]
            if not grown.size:
                break
        return self.state(state.q + step, state.approach)

    def state(self, q: Floats, before: DomeApproach) -> _DomeState:
        """Return the domes at trial depths q (poses, tips) [mm], and what they miss of equilibrium.

        Springs move the domes by the forces along the normals as they stood `before`; at equilibrium both are the same.
        """
        N = self._hertz(q, before)[0]
        moved = np.tensordot(N[..., None] * before.direction, self._C, axes=((1, 2), (1, 3)))
        approach = self._poses.approach(moved)
        N, stiffness, radius, strain = self._hertz(q, approach)

        # The slope that the others make under a dome moves its contact by its radius times that slope.
        between, distance = _between(approach.foot)
        slope = self._point_load * np.einsum("pij,pijk->pik", N[:, None] / distance**3, between) / self._E[..., None]
        shift = approach.radius[..., None] * slope
        _, distance = _between(approach.foot + shift)
        action = self._point_load / distance * (1.0 + _moments(radius, FELT, ACTING) / distance**2)  # k_ij

        deflection = np.einsum("pij,pj->pi", action + self._body.remainder, N) / self._E
        by_slope = 0.5 * (shift**2).sum(axis=2) / approach.radius
        residual = approach.interference - by_slope - deflection - q
        return _DomeState(approach, N, stiffness, radius, strain, action, residual, q)

    def normal_compliance(self, approach: DomeApproach) -> Floats:
        """Return the compliance of the springs along the normals of the domes [mm/N], (poses, tips, tips).

        Entry ij is n_i . C_ij n_j, with C_ij the 3 x 3 compliance between two tips and n the normals.
        """
        normals = approach.direction
        # Reshaped so that the sum over the axes of n_i is one product of matrices for each dome.
        of_each = self._C.transpose(0, 2, 1, 3).reshape(len(self._C), 3, -1)
        moved = (normals.swapaxes(0, 1) @ of_each).reshape(len(self._C), len(normals), -1, 3)
        return np.asarray(np.einsum("ipjb,pjb->pij", moved, normals))

    def _hertz(self, q: Floats, approach: DomeApproach) -> tuple[Floats, Floats, Floats, LargeStrain]:
        """Return the normal forces [N], their slopes over q [N/mm], Hertz's contact radii [mm], and large strain."""
        depth = np.maximum(q, 0.0) / approach.depth_ratio
        if self._body.skinned is not None:
            return self._layered_hertz(depth, approach, self._body.skinned)
        contact = np.sqrt(approach.radius * depth)
        strain = self._large_strain(contact, approach)
        stiffness = 2.0 * self._E / (1.0 - self._body.poisson**2) * contact  # of Hertz: force = stiffness depth / 1.5
        # The contact radius a is proportional to the root of the depth: dF/d(depth) = stiffness (g + dg/d(ln a) / 3).
        slope = stiffness * (strain.factor + strain.slope / 3.0) / approach.depth_ratio
        return strain.factor * stiffness * depth / 1.5, slope, contact, strain

    def _layered_hertz(
        self, depth: Floats, approach: DomeApproach, skinned: RoundContact
    ) -> tuple[Floats, Floats, Floats, LargeStrain]:
        """Return forces, slopes, contact radii and large strain, as `_hertz`, on flesh under a skin.

        All that large strain does to bare flesh counts as an error here.
        """
        contact, force, stiffness = skinned.press(approach.radius * depth)
        bare = self._large_strain(contact, approach)
        one = np.ones_like(contact)
        error = np.abs(bare.factor - one)
        strain = replace(bare, error=error, edge=one, edge_error=np.abs(bare.edge - one))
        return self._E * force / approach.radius, self._E * stiffness / approach.depth_ratio, contact, strain

    def _large_strain(self, contact: Floats, approach: DomeApproach) -> LargeStrain:
        """Return the corrections for large strain of bare flesh at contact radii (poses, tips) [mm]."""
        return large_strain(contact, self._poses.dome_radius, self._fruit_curvature(approach), self._body.poisson)

    def jacobian(self, state: _DomeState) -> Floats:
        """Return minus the slope of the residual over the depths [1], (poses, tips, tips), but for its small parts."""
        compliance = self.normal_compliance(state.approach) + (state.action + self._body.remainder) / self._E[..., None]
        return np.eye(len(self._C)) + compliance * state.stiffness[:, None, :]

    def bound(self, state: _DomeState) -> Floats:
        """Return the error bound of the interference that belongs to the forces [mm], (poses, tips).

        It adds up what the compliances leave out, a fraction of the depth, the error of the sideways compliance, and
        that of large strain.
        """
        _, distance = _between(state.approach.foot)
        radius = state.contact_radius
        body = self._body
        # Compliances that are left out: what the body's varies over a contact, and the next moments of the crosstalk.
        over_contact = OVER_CONTACT * np.abs(body.remainder) * (radius[:, None] / body.size) ** 2
        next_moment = NEXT_MOMENT * self._point_load / distance * (_moments(radius, 0.5, 0.5) / distance**2) ** 2
        left_out = body.bound + over_contact + next_moment + self._moved_bound(state)
        by_forces = np.einsum("pij,pj->pi", left_out, state.N) / self._E
        depth = radius**2 / state.approach.radius
        by_leaning = self._sideways_error * self._leaning_deflection(state)
        return np.asarray(by_forces + OF_DEPTH * depth + by_leaning + self.depth_change(state, state.strain.error))

    def _moved_bound(self, state: _DomeState) -> Floats:
        """Return the bound of the body's compliance as domes touch elsewhere than it was solved [1/mm]."""
        body = self._body
        moved = np.linalg.norm(state.approach.foot[..., :2] - body.feet, axis=-1)
        growth = moved * (moved + 2.0 * np.linalg.norm(body.feet, axis=-1)) / body.size**2
        either = np.maximum(growth[:, :, None], growth[:, None, :])
        return np.asarray(ELSEWHERE * either * np.abs(body.remainder))

    def _leaning_deflection(self, state: _DomeState) -> Floats:
        """Return how far domes yield along their normals by the parts of forces across the axis [mm], (poses, tips)."""
        cosine = state.approach.cosine
        along_press = cosine[:, :, None] * self._C[..., 2, 2] * cosine[:, None, :]
        leaning = self.normal_compliance(state.approach) - along_press
        return np.asarray(np.abs(np.einsum("pij,pj->pi", leaning, state.N)))

    def rim_radius(self, state: _DomeState) -> Floats:
        """Return the contact radii that spheres with their own profile have at the same depths [mm], (poses, tips)."""
        depth = state.contact_radius**2 / state.approach.radius
        return sphere_contact_radius(depth, self._poses.dome_radius, self._fruit_curvature(state.approach))

    def depth_change(self, state: _DomeState, fraction: Floats) -> Floats:
        """Return the change of depth that changes each force by a fraction of it [mm], (poses, tips)."""
        return fraction * state.N / np.where(state.stiffness > 0.0, state.stiffness, 1.0)

    def _fruit_curvature(self, approach: DomeApproach) -> Floats:
        """Return the curvature of the fruit under the domes [1/mm], (poses, tips)."""
        return 1.0 / approach.radius - 1.0 / self._poses.dome_radius


def _between(feet: Floats) -> tuple[Floats, Floats]:
    """Return the vectors from contact j to contact i [mm] and their lengths, infinite from one to itself."""
    between = feet[:, :, None] - feet[:, None]
    distance = np.sqrt(np.einsum("pijk,pijk->pij", between, between))
    return between, distance + np.where(np.eye(distance.shape[1]) > 0.0, np.inf, 0.0)


def _moments(radius: Floats, felt: float, acting: float) -> Floats:
    """Return felt a_i^2 + acting a_j^2 [mm^2] of contact radii a (poses, tips) [mm], (poses, tips, tips)."""
    return felt * radius[:, :, None] ** 2 + acting * radius[:, None, :] ** 2
