"""Forces of sprung domes in closed form: Hertz contacts that interact with each other and with the body of the fruit.

Let q [mm] be the depth of a dome along the normal, beyond the deflection caused by the other domes and the body. Its
normal force is

    N = 4/3 g E* sqrt(R) q^(3/2),    E* = E / (1 - nu^2),    1 / R = 1 / r + 1 / R_fruit,

K. L. Johnson, Contact Mechanics (1985), equation (4.23), doi:10.1017/CBO9781139171731, with the factor g of large
strain (`large_strain.py`). Its interference b is its depth in the undeformed fruit at the present deflection of its
spring,

    b_i = q_i + sum_j (B_ij + k_ij) N_j / E,
    k_ij = (1 - nu^2) / (pi p) (1 + a_i^2 / (6 p^2) + a_j^2 / (10 p^2)),

with p the distance of two contacts, a their radii, and B the compliance that the body adds to a half-space, along the
normals at the contacts. The factors of a^2 are second moments of pressures: Hertz's pressure at the acting contact, and
the flat punch, its increment, at the deflected one. The other domes tilt the surface under a dome by some slope, which
moves its contact by R times the slope. The force along the spring is N times the cosine between normal and axis. The
transverse part of N moves the dome sideways, as far as the housing yields. A dome out of contact has q <= 0 and no
force. This is one smooth system, solved by Newton's method. Friction is neglected. The flesh is neo-Hookean; the
difference of other laws is reported separately. Under a skin, N is the force on a layered half-space at small strain
(`solve/halfspace/layered.py`), and the whole effect of large strain on bare flesh is part of the error.
"""

from dataclasses import dataclass, replace

import numpy as np

from sensor.arrays import Floats, Ints
from solve.contact.domes.fruit_under_domes import FruitUnderDomes, dome_body
from solve.contact.domes.geometry import DomeApproach, DomePoses, dome_poses
from solve.contact.domes.large_strain import LargeStrain, large_strain
from solve.contact.domes.sphere import sphere_contact_radius
from solve.contact.scene import Scene, SidewaysGive
from solve.fruit.compliance import FruitCompliance
from solve.halfspace.layered import RoundContact
from solve.linear import SolveError

# Mean of x^2 - y^2 / 2 under the flat punch and under Hertz's pressure [contact radii^2].
FELT = 1.0 / 6.0
ACTING = 1.0 / 10.0
MOST_STEPS = 60  # steps of Newton's method
STEPS_ALONE = 5  # Newton steps of each dome without the others, for a starting point
HALVINGS = 12  # most halvings of a Newton step
# Relative change of the body's compliance for domes that touch elsewhere than in its solve. It is per increase of their
# squared distance from the middle, over the squared size of the body. tests/reference/fits/test_contact.py
ELSEWHERE = 2.0
# Bounds on neglected terms, which tests/solve/contact/domes/test_law.py compares with cells: the change of the body's
# deflection over a contact, times (a / size)^2; the next moments of the crosstalk; the rest as a fraction of the depth.
OVER_CONTACT = 0.25
NEXT_MOMENT = 0.5
OF_DEPTH = 7e-4
RESIDUAL_LIMIT = 1e-12  # largest residual over the largest coordinate of a dome, unless round-off is larger
# Round-off over the largest semi-axis, because contacts are computed from the fruit's centre: 3 epsilon were seen.
ROUND_OFF = 10.0 * float(np.finfo(np.float64).eps)


@dataclass(frozen=True, eq=False)
class DomeForces:
    """Forces F of the domes along their springs [N], with their errors and contacts, all (poses, tips).

    `rates` [N/mm] are the slopes of F over the travel. `error` [N] bounds the error of each force in neo-Hookean flesh.
    `error_alike` [N] is the joint error of all forces if the error has one sign under all domes, such as a softer
    fruit. `flesh` [N] is the increase of F by Hencky's law of flesh, and the decrease by Storakers' law.
    `contact_radius` [mm] and `mean_pressure` [MPa] belong to the deformed contacts. `pressure_error` [1] is the
    relative error of the pressure due only to the contact radius. `face` [mm] is the diameter of a face that would just
    hold the contact.
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
    """Domes at trial depths q [mm], (poses, tips) except for `approach`, `strain` and `action`.

    `N` [N] are the normal forces, `stiffness` [N/mm] their slopes over q, `contact_radius` [mm] Hertz's contact radii.
    `action` (poses, tips, tips) is k_ij of the module docstring, times E [1/mm]. `residual` [mm] is the residual of its
    equation for b_i.
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

    `body` is the compliance that the fruit adds to a half-space, in the same poses. Raises SolveError if Newton's
    method does not converge.
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
        error_alike=np.einsum("pij,pj->pi", gain, bound),  # all interferences err with one sign
        flesh=np.einsum("pij,pj->pi", gain, flesh),
        contact_radius=contact_radius,
        mean_pressure=state.N / np.where(touching, np.pi * contact_radius**2, 1.0),
        pressure_error=np.where(touching, 2.0 * state.strain.edge_error, 0.0),
        face=np.where(touching, face, 0.0),
    )


@dataclass(frozen=True, eq=False)
class DomeContrast:
    """The constants of level domes for the contrast of the forces along the springs (`sensor/theory/contrast_law.py`).

    `S` (tips, tips), times E [1/mm], is the compliance without Hertz's part. `hertz` [mm (MPa/N)^(2/3)] is the mean of
    h in h (F / E)^(2/3) over the tips. `lean` (tips, tips) [mm/N] is added to the compliance of the springs. It comes
    from forces that lean on the slope of the fruit, and move the tips sideways.
    """

    S: Floats
    hertz: float
    lean: Floats


def dome_contrast(scene: Scene, compliance: FruitCompliance, C: Floats, E: float) -> DomeContrast:
    """Return the constants of domes for the contrast law, at a level press at modulus E [MPa] over the full travel.

    C (tips, tips) [mm/N] is the compliance of the springs. Normal forces are converted to forces along the springs by
    the cosines of their angles. Raises SolveError if Newton's method does not converge, and if a dome does not touch,
    because its part in the contrast is then unknown.
    """
    level = replace(scene, press=replace(scene.press, tilt_deg=0.0, roll_deg=0.0), off_centre_mm=(0.0, 0.0))
    body = dome_body(scene, compliance, [scene.fruit])
    law = _Law(dome_poses([level], np.array([scene.press.travel_mm])), np.array([E]), C, body)
    state = law.equilibrium()
    lifted = int((state.N[0] <= 0.0).sum())
    if lifted:
        hint = "press deeper, or take stiffer springs or a softer skin"
        msg = f"domes: {lifted} of {len(C)} do not touch at full travel of a level press: all must touch; {hint}"
        raise SolveError(msg)
    cosine = state.approach.cosine[0]
    hertz = state.q[0] / cosine * (E / (cosine * state.N[0])) ** (2.0 / 3.0)
    return DomeContrast(
        S=(body.remainder + state.action)[0] / np.outer(cosine, cosine),
        hertz=float(np.mean(hertz)),
        lean=law.normal_compliance(state.approach)[0] / np.outer(cosine, cosine) - C,
    )


class _Law:
    """The equations of the domes for the depths q (poses, tips) [mm], negative for a dome out of contact."""

    def __init__(self, poses: DomePoses, E: Floats, C: Floats, body: FruitUnderDomes) -> None:
        """Store the domes, the moduli E (poses,) [MPa], the springs C (tips, tips) [mm/N] and the body."""
        self._poses = poses
        sideways = poses.sideways or SidewaysGive(np.zeros((*C.shape, 3, 3)), 0.0)
        self._springs = C
        self._C = sideways.compliance.copy()  # (tips, tips, 3, 3) [mm/N], in the frame of the sensor
        self._C[..., 2, 2] += C
        self._sideways_error = sideways.error
        self._body = body
        self._E = E[:, None]
        self._point_load = (1.0 - body.poisson**2) / np.pi  # deflection times distance times E over force [1]

    def equilibrium(self) -> _DomeState:
        """Return the domes in equilibrium; raises SolveError if Newton's method with halved steps does not converge."""
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
        """Return the residual at convergence [mm], above the round-off of the positions where domes meet the fruit."""
        semi_axes = self._poses.semi_axes
        round_off = ROUND_OFF * semi_axes.max(initial=0.0, where=np.isfinite(semi_axes))
        return max(RESIDUAL_LIMIT * float(np.abs(self._poses.centres).max()), float(round_off))

    def _depths_alone(self, unmoved: DomeApproach) -> Floats:
        """Return approximate depths of the domes [mm], each on its own spring, without the others and the body.

        Newton's method starts at the undeformed fruit and approaches the root without overshooting, because the force
        is convex over the depth.
        """
        compliance = np.einsum("pii->pi", self.normal_compliance(unmoved))
        q = unmoved.interference
        for _ in range(STEPS_ALONE):
            N, stiffness, _, _ = self._hertz(q, unmoved)
            q = q - (q + compliance * N - unmoved.interference) / (1.0 + compliance * stiffness)
        return np.asarray(q)

    def _halved(self, state: _DomeState, step: Floats, grown: Ints, worst: Floats) -> _DomeState:
        """Return the state after steps (poses, tips) [mm], with halved steps in the poses whose residual has grown.

        The steps of the `grown` poses are halved until none of their residuals exceeds `worst` (poses,) [mm].
        """
        for _ in range(HALVINGS):
            step[grown] *= 0.5
            few = _Law(self._poses.select(grown), self._E[grown, 0], self._springs, self._body.select(grown))
            trial = few.state(state.q[grown] + step[grown], state.approach.select(grown))
            grown = grown[np.abs(trial.residual).max(axis=1) > worst[grown]]
            if not grown.size:
                break
        return self.state(state.q + step, state.approach)

    def state(self, q: Floats, before: DomeApproach) -> _DomeState:
        """Return the domes at trial depths q (poses, tips) [mm], with the residual of their equilibrium.

        The springs deflect under the forces along the normals of the state `before`; at equilibrium both states agree.
        """
        N = self._hertz(q, before)[0]
        moved = np.tensordot(N[..., None] * before.direction, self._C, axes=((1, 2), (1, 3)))
        approach = self._poses.approach(moved)
        N, stiffness, radius, strain = self._hertz(q, approach)

        # The other domes tilt the surface under a dome by `slope`, which moves its contact by its radius times the
        # slope.
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
        # After this reshape, the sum over the axes of n_i is one matrix product per dome.
        of_each = self._C.transpose(0, 2, 1, 3).reshape(len(self._C), 3, -1)
        moved = (normals.swapaxes(0, 1) @ of_each).reshape(len(self._C), len(normals), -1, 3)
        return np.asarray(np.einsum("ipjb,pjb->pij", moved, normals))

    def _hertz(self, q: Floats, approach: DomeApproach) -> tuple[Floats, Floats, Floats, LargeStrain]:
        """Return normal forces [N], slopes over q [N/mm], Hertz's contact radii [mm], and large-strain corrections."""
        depth = np.maximum(q, 0.0) / approach.depth_ratio
        if self._body.skinned is not None:
            return self._layered_hertz(depth, approach, self._body.skinned)
        contact = np.sqrt(approach.radius * depth)
        strain = self._large_strain(contact, approach)
        stiffness = 2.0 * self._E / (1.0 - self._body.poisson**2) * contact  # by Hertz: force = stiffness depth / 1.5
        # The contact radius a is proportional to the root of the depth: dF/d(depth) = stiffness (g + dg/d(ln a) / 3).
        slope = stiffness * (strain.factor + strain.slope / 3.0) / approach.depth_ratio
        return strain.factor * stiffness * depth / 1.5, slope, contact, strain

    def _layered_hertz(
        self, depth: Floats, approach: DomeApproach, skinned: RoundContact
    ) -> tuple[Floats, Floats, Floats, LargeStrain]:
        """Return forces, slopes, contact radii and large strain, as `_hertz` does, on flesh under a skin.

        The whole effect of large strain on bare flesh is an error here, because the layered solution has small strain.
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
        """Return minus the slope of the residual over the depths [1], (poses, tips, tips), without small terms."""
        compliance = self.normal_compliance(state.approach) + (state.action + self._body.remainder) / self._E[..., None]
        return np.eye(len(self._C)) + compliance * state.stiffness[:, None, :]

    def bound(self, state: _DomeState) -> Floats:
        """Return the error bound of the interference at given forces [mm], (poses, tips).

        It sums the neglected compliances, a fraction of the depth, and the errors of the sideways compliance and of
        large strain.
        """
        _, distance = _between(state.approach.foot)
        radius = state.contact_radius
        body = self._body
        # Neglected compliances: the variation of the body's over a contact, and the next moments of the crosstalk.
        over_contact = OVER_CONTACT * np.abs(body.remainder) * (radius[:, None] / body.size) ** 2
        next_moment = NEXT_MOMENT * self._point_load / distance * (_moments(radius, 0.5, 0.5) / distance**2) ** 2
        left_out = body.bound + over_contact + next_moment + self._moved_bound(state)
        by_forces = np.einsum("pij,pj->pi", left_out, state.N) / self._E
        depth = radius**2 / state.approach.radius
        by_leaning = self._sideways_error * self._leaning_deflection(state)
        return np.asarray(by_forces + OF_DEPTH * depth + by_leaning + self.depth_change(state, state.strain.error))

    def _moved_bound(self, state: _DomeState) -> Floats:
        """Return the error bound of the body's compliance [1/mm] for domes that touch elsewhere than in its solve."""
        body = self._body
        moved = np.linalg.norm(state.approach.foot[..., :2] - body.feet, axis=-1)
        growth = moved * (moved + 2.0 * np.linalg.norm(body.feet, axis=-1)) / body.size**2
        either = np.maximum(growth[:, :, None], growth[:, None, :])
        return np.asarray(ELSEWHERE * either * np.abs(body.remainder))

    def _leaning_deflection(self, state: _DomeState) -> Floats:
        """Return the deflections along the normals that the transverse forces cause [mm], (poses, tips)."""
        cosine = state.approach.cosine
        along_press = cosine[:, :, None] * self._C[..., 2, 2] * cosine[:, None, :]
        leaning = self.normal_compliance(state.approach) - along_press
        return np.asarray(np.abs(np.einsum("pij,pj->pi", leaning, state.N)))

    def rim_radius(self, state: _DomeState) -> Floats:
        """Return the contact radii of spheres, instead of paraboloids, at the same depths [mm], (poses, tips)."""
        depth = state.contact_radius**2 / state.approach.radius
        return sphere_contact_radius(depth, self._poses.dome_radius, self._fruit_curvature(state.approach))

    def depth_change(self, state: _DomeState, fraction: Floats) -> Floats:
        """Return the changes of depth that change each force by a fraction of it [mm], (poses, tips)."""
        return fraction * state.N / np.where(state.stiffness > 0.0, state.stiffness, 1.0)

    def _fruit_curvature(self, approach: DomeApproach) -> Floats:
        """Return the curvature of the fruit under the domes [1/mm], (poses, tips)."""
        return 1.0 / approach.radius - 1.0 / self._poses.dome_radius


def _between(feet: Floats) -> tuple[Floats, Floats]:
    """Return the vectors from contact j to contact i [mm] and their lengths, whose diagonal is infinite."""
    between = feet[:, :, None] - feet[:, None]
    distance = np.sqrt(np.einsum("pijk,pijk->pij", between, between))
    return between, distance + np.where(np.eye(distance.shape[1]) > 0.0, np.inf, 0.0)


def _moments(radius: Floats, felt: float, acting: float) -> Floats:
    """Return felt a_i^2 + acting a_j^2 [mm^2] of contact radii a (poses, tips) [mm], (poses, tips, tips)."""
    return felt * radius[:, :, None] ** 2 + acting * radius[:, None, :] ** 2
