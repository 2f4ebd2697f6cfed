"""The dome law: forces on sprung domes, from Hertz contacts that interact with each other and with the finite fruit.

Let q [mm] be the local indentation under a dome, along the normal. It is the depth of the dome minus the surface
deflection that the other domes and the finite size of the fruit cause. The normal force of the dome is

    N = 4/3 g E* sqrt(R) q^(3/2),    E* = E / (1 - nu^2),    1 / R = 1 / r + 1 / R_fruit.

This is equation (4.23) of K. L. Johnson, Contact Mechanics (1985), doi:10.1017/CBO9781139171731. The factor g corrects
it for large strain (`large_strain.py`). The interference b of a dome is its depth in the undeformed fruit after its
spring has deflected. It is the sum of the local indentation and of all surface deflections,

    b_i = q_i + sum_j (B_ij + k_ij) N_j / E,
    k_ij = (1 - nu^2) / (pi p) (1 + a_i^2 / (6 p^2) + a_j^2 / (10 p^2)).

Here p is the distance between two contacts, and a_i and a_j are their radii. B is the compliance that the finite fruit
adds to a half-space, times E, along the normals at the contacts. The terms in a^2 are second moments of pressures. At
the loading contact j, the pressure is Hertz's. At the deflected contact i, it is the pressure of a flat punch, which is
the increment of Hertz's pressure.

The other domes tilt the surface under a dome, which moves its contact by R times the slope of the tilt. The force along
the spring is N times the cosine of the angle between the normal and the axis of the spring. The transverse component of
N moves the dome sideways, according to the lateral compliance of the housing. A dome out of contact has q <= 0 and no
force. The equations are smooth, and Newton's method solves them. Friction is neglected. The flesh is neo-Hookean; the
effect of other material laws is reported separately. Under a skin, N is the small-strain force on a layered half-space
(`solve/halfspace/layered.py`). The entire effect of large strain is then included in the error.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from sensor.arrays import Floats, Ints
from solve.contact.domes.fruit_under_domes import FruitUnderDomes, fruit_under_domes
from solve.contact.domes.geometry import DomeApproach, DomePoses, dome_poses
from solve.contact.domes.large_strain import LargeStrain, large_strain
from solve.contact.domes.sphere import sphere_contact_radius
from solve.contact.scene import LateralCompliance, Scene
from solve.fruit.compliance import FruitCompliance
from solve.halfspace.layered import RoundContact
from solve.linear import SolveError

# Mean of x^2 - y^2 / 2 over a pressure distribution, in squared contact radii.
DEFLECTED = 1.0 / 6.0  # flat punch, at the deflected contact
LOADING = 1.0 / 10.0  # Hertz's pressure, at the loading contact
MOST_STEPS = 60  # maximum number of Newton steps
INITIAL_STEPS = 5  # number of Newton steps for the initial guess, which treats each dome separately
HALVINGS = 12  # maximum number of halvings of a Newton step
# Relative change in the added compliance if a contact is not where the compliance was solved. The change is the factor
# times the increase in squared distance from the middle, divided by the squared distance to the boundary. See
# tests/reference/fits/test_contact.py.
MOVED_CONTACT_FACTOR = 2.0
# Factors in the error bounds of neglected terms. tests/solve/contact/domes/test_law.py compares them with contact
# cells.
VARIATION_OVER_CONTACT = 0.25  # variation of the added deflection over a contact, divided by (a / boundary_distance)^2
NEXT_MOMENT_FACTOR = 0.5  # terms of the crosstalk in the fourth power of a
DEPTH_FRACTION = 7e-4  # all smaller terms, as a fraction of the depth
RESIDUAL_LIMIT = 1e-12  # largest residual divided by the largest coordinate of a dome, unless round-off is larger
# Round-off error divided by the largest semi-axis. Contacts are computed relative to the centre of the fruit; errors of
# up to 3 epsilon were observed.
ROUND_OFF = 10.0 * float(np.finfo(np.float64).eps)


@dataclass(frozen=True, eq=False)
class DomeForces:
    """The forces F of the domes along their springs [N], with their errors and contacts; all arrays are (poses, tips).

    `rates` [N/mm] are the derivatives of F with respect to a vertical travel. `error` [N] bounds the error of each
    force on neo-Hookean flesh. `common_error` [N] is the error of each force if the errors of all domes have the same
    sign, as on a softer fruit. `flesh` [N] is the increase of F if the flesh obeys Hencky's law, and the decrease if it
    obeys Storakers's law. `contact_radius` [mm] and `mean_pressure` [MPa] describe the deformed contacts.
    `pressure_error` [1] is the relative error of the pressure that the error of the contact radius causes. `face` [mm]
    is the diameter of the smallest tip face that contains the contact.
    """

    F: Floats
    rates: Floats
    error: Floats
    common_error: Floats
    flesh: Floats
    contact_radius: Floats
    mean_pressure: Floats
    pressure_error: Floats
    face: Floats

    @property
    def relative_error(self) -> Floats:
        """Return the relative error of each nonzero force [1], and 0 for domes out of contact, shape (poses, tips)."""
        touching = self.F > 0.0
        return np.where(touching, self.error / np.where(touching, self.F, 1.0), 0.0)


@dataclass(frozen=True, eq=False)
class _DomeState:
    """The domes at trial values q (poses, tips) [mm] of the local indentation, in the notation of the module docstring.

    `N` [N] are the normal forces, and `stiffness` [N/mm] their derivatives dN/dq. `contact_radius` [mm] holds Hertz's
    contact radii. `crosstalk` (poses, tips, tips) [1/mm] is k_ij. `residual` [mm] is the residual of the equation for
    b_i.
    """

    approach: DomeApproach
    N: Floats
    stiffness: Floats
    contact_radius: Floats
    strain: LargeStrain
    crosstalk: Floats
    residual: Floats
    q: Floats


def dome_forces(poses: DomePoses, E: Floats, C: Floats, fruit: FruitUnderDomes) -> DomeForces:
    """Return the forces of domes at moduli E (poses,) [MPa], on springs with the compliance C (tips, tips) [mm/N].

    `poses` holds the domes on undeflected springs. `fruit` holds the compliance that the fruit adds to a half-space, in
    the same poses. Raises SolveError if Newton's method does not converge.
    """
    law = _Law(poses, E, C, fruit)
    state = law.find_equilibrium()
    cosine = state.approach.cosine  # the force along the spring divided by the normal force
    is_touching = state.N > 0.0
    contact_radius = state.contact_radius * state.strain.edge  # corrected for large strain
    # All errors and changes are expressed as interferences [mm], and converted to forces by this derivative [N/mm] of
    # the force along spring i with respect to the interference of dome j.
    force_per_interference = (cosine * state.stiffness)[..., None] * np.linalg.inv(law.jacobian(state))
    interference_bound = law.bound_interference_error(state)
    # Interference that changes the forces as much as another material law does.
    law_spread_interference = law.depth_change(state, state.strain.law_spread)
    # Per unit of vertical travel, each interference increases by the vertical component of its normal.
    rates = np.einsum("pij,pj->pi", force_per_interference, state.approach.normal[..., 2])
    # A face that contains the contact must reach the farthest edge of the contact.
    face = 2.0 * (poses.distance_from_face_middle(state.approach) + law.rim_radius(state))
    return DomeForces(
        F=cosine * state.N,
        rates=np.where(is_touching, rates, 0.0),
        error=np.einsum("pij,pj->pi", np.abs(force_per_interference), interference_bound),
        # Without absolute values, the errors of all interferences have the same sign.
        common_error=np.einsum("pij,pj->pi", force_per_interference, interference_bound),
        flesh=np.einsum("pij,pj->pi", force_per_interference, law_spread_interference),
        contact_radius=contact_radius,
        mean_pressure=state.N / np.where(is_touching, np.pi * contact_radius**2, 1.0),
        pressure_error=np.where(is_touching, 2.0 * state.strain.edge_error, 0.0),
        face=np.where(is_touching, face, 0.0),
    )


@dataclass(frozen=True, eq=False)
class DomeContrast:
    """The constants of level domes in the contrast law (`sensor/theory/contrast_law.py`), for forces along the springs.

    `S` (tips, tips) [1/mm] is the compliance of the fruit times E, without Hertz's part. Hertz's part of an indentation
    is h (F / E)^(2/3), and `hertz` [mm (MPa/N)^(2/3)] is the mean of h over the tips. `inclination_compliance` (tips,
    tips) [mm/N] is added to the compliance of the springs. It arises because contact forces are normal to the sloping
    fruit, and so push the tips sideways too.
    """

    S: Floats
    hertz: float
    inclination_compliance: Floats


def dome_contrast(scene: Scene, compliance: FruitCompliance, C: Floats, E: float) -> DomeContrast:
    """Return the constants of domes in the contrast law, from a level press to full travel at the modulus E [MPa].

    `compliance` is the compliance of the scene's fruit, and C (tips, tips) [mm/N] is the compliance of the springs. The
    constants are derived for forces along the contact normals. The cosines of the angles between these normals and the
    axis convert them to constants for forces along the springs. Raises SolveError if Newton's method does not converge.
    Also raises SolveError if a dome does not touch, because its constants are then unknown.
    """
    # The contrast law describes a level press above the apex. It is solved as a single pose, which has index 0.
    level_scene = replace(scene, press=replace(scene.press, tilt_deg=0.0, roll_deg=0.0), off_centre_mm=(0.0, 0.0))
    fruit = fruit_under_domes(scene, compliance, [scene.fruit])
    law = _Law(dome_poses([level_scene], np.array([scene.press.travel_mm])), np.array([E]), C, fruit)
    state = law.find_equilibrium()
    _check_all_touch(state.N[0])
    # Along the spring, the force is N times the cosine, and the indentation is q divided by the cosine.
    cosine = state.approach.cosine[0]
    hertz = state.q[0] / cosine * (E / (cosine * state.N[0])) ** (2.0 / 3.0)  # h, from the indentation h (F / E)^(2/3)
    return DomeContrast(
        S=(fruit.remainder + state.crosstalk)[0] / np.outer(cosine, cosine),
        hertz=float(np.mean(hertz)),
        inclination_compliance=law.normal_compliance(state.approach)[0] / np.outer(cosine, cosine) - C,
    )


def _check_all_touch(N: Floats) -> None:
    """Raise SolveError if a dome has no normal force N (tips,) [N] in a level press to full travel."""
    untouched_count = int((N <= 0.0).sum())
    if untouched_count:
        hint = "Press deeper, or use stiffer springs or a softer skin."
        msg = (
            f"domes: {untouched_count} of {len(N)} do not touch at full travel of a level press, but all must touch. "
            f"{hint}"
        )
        raise SolveError(msg)


class _LocalContact(NamedTuple):
    """The contact of each dome at given local indentations; arrays are (poses, tips).

    `N` [N] is the normal force, `stiffness` [N/mm] is dN/dq, and `radius` [mm] is Hertz's contact radius. `strain` has
    the corrections for large strain.
    """

    N: Floats
    stiffness: Floats
    radius: Floats
    strain: LargeStrain


class _Law:
    """The equations of the dome law, whose unknowns are the local indentations q (poses, tips) [mm].

    The indentation of a dome out of contact is negative.
    """

    def __init__(self, poses: DomePoses, E: Floats, C: Floats, fruit: FruitUnderDomes) -> None:
        """Store the arguments of `dome_forces`, and add the axial compliance C to the lateral compliance of the tips.

        The sum is a 3 x 3 matrix for each pair of tips, because a lateral force can also move a dome along its spring.
        """
        self._poses = poses
        # Without a known lateral compliance, the tips are rigid sideways.
        sideways = poses.sideways or LateralCompliance(np.zeros((*C.shape, 3, 3)), 0.0)
        self._axial_compliance = C
        self._compliance = sideways.compliance.copy()  # (tips, tips, 3, 3) [mm/N], in the frame of the sensor
        self._compliance[..., 2, 2] += C
        self._sideways_error = sideways.error
        self._fruit = fruit
        self._E = E[:, None]
        # Boussinesq's surface deflection under a point load, times E and the distance, divided by the force [1].
        self._point_load = (1.0 - fruit.poisson**2) / np.pi

    def find_equilibrium(self) -> _DomeState:
        """Return the domes in equilibrium, found by Newton's method with step halving.

        All poses are solved together. If a step would increase the residual of some poses, it is halved in these poses.
        Raises SolveError if the method does not converge.
        """
        undeflected = self._poses.approach(np.zeros(self._poses.centres.shape))
        state = self.evaluate(self._independent_indentations(undeflected), undeflected)
        tolerance = self._residual_tolerance()
        for _ in range(MOST_STEPS):
            if np.abs(state.residual).max(initial=0.0) <= tolerance:
                return state
            # Below the tolerance, a residual may increase, because it is only round-off.
            allowed_residual = np.maximum(np.abs(state.residual).max(axis=1), tolerance)
            # The sign is positive, because `jacobian` returns minus the derivative of the residual.
            step = np.linalg.solve(self.jacobian(state), state.residual[..., None])[..., 0]
            trial = self.evaluate(state.q + step, state.approach)
            increased = np.flatnonzero(np.abs(trial.residual).max(axis=1) > allowed_residual)
            if increased.size:
                state = self._take_halved_step(state, np.asarray(step), increased, allowed_residual)
            else:
                state = trial
        residual = np.abs(state.residual).max()
        hint = "Press less deeply, or use stiffer springs."
        msg = f"domes: residual {residual:.1e} mm must be at most {tolerance:.0e} mm. {hint}"
        raise SolveError(msg)

    def _residual_tolerance(self) -> float:
        """Return the largest residual at convergence [mm], chosen above the round-off of the contact positions."""
        semi_axes = self._poses.semi_axes
        round_off = ROUND_OFF * semi_axes.max(initial=0.0, where=np.isfinite(semi_axes))
        return max(RESIDUAL_LIMIT * float(np.abs(self._poses.centres).max()), float(round_off))

    def _independent_indentations(self, undeflected: DomeApproach) -> Floats:
        """Return approximate indentations q (poses, tips) [mm] for domes that do not interact, as an initial guess.

        `undeflected` is the approach of the domes while their springs are undeflected. Each dome satisfies
        q + C_ii N(q) = interference, with its own spring compliance C_ii. Newton's method starts from the interference.
        It converges monotonically, because the force N is a convex function of q.
        """
        own_compliance = np.einsum("pii->pi", self.normal_compliance(undeflected))
        q = undeflected.interference
        for _ in range(INITIAL_STEPS):
            N, stiffness, _, _ = self._local_contact(q, undeflected)
            q = q - (q + own_compliance * N - undeflected.interference) / (1.0 + own_compliance * stiffness)
        return np.asarray(q)

    def _take_halved_step(
        self, state: _DomeState, step: Floats, increased: Ints, allowed_residual: Floats
    ) -> _DomeState:
        """Return the state after a step (poses, tips) [mm] that is halved in some poses.

        `state` is the state before the step. `increased` holds the indices of the poses whose residual the full step
        increases. In these poses, the step is halved up to HALVINGS times, until the residual is at most
        `allowed_residual` (poses,) [mm]. The last step is used even if its residual is larger. `step` is modified in
        place.
        """
        halved = increased  # indices of the poses whose step is halved once more
        for _ in range(HALVINGS):
            step[halved] *= 0.5
            # Poses do not interact, so only the poses whose step was halved are evaluated again.
            law_of_subset = _Law(
                self._poses.select(halved),
                self._E[halved, 0],
                self._axial_compliance,
                self._fruit.select(halved),
            )
            trial = law_of_subset.evaluate(state.q[halved] + step[halved], state.approach.select(halved))
            is_too_large = np.abs(trial.residual).max(axis=1) > allowed_residual[halved]
            halved = halved[is_too_large]
            if not halved.size:
                break
        return self.evaluate(state.q + step, state.approach)

    def evaluate(self, q: Floats, previous: DomeApproach) -> _DomeState:
        """Return the domes at trial indentations q (poses, tips) [mm], with the residuals of their equations.

        The residual [mm] is b_i - d_i - q_i - sum_j (B_ij + k_ij) N_j / E, in the notation of the module docstring. The
        interference b decreases by d, because the contacts move sideways. The springs deflect under forces along the
        normals of the `previous` approach. At equilibrium, these normals agree with the new ones.
        """
        # Deflect the springs under the forces of the previous normals, and find the new approach of the domes.
        previous_N = self._local_contact(q, previous).N
        displacements = np.tensordot(
            previous_N[..., None] * previous.direction, self._compliance, axes=((1, 2), (1, 3))
        )
        approach = self._poses.approach(displacements)
        N, stiffness, radius, strain = self._local_contact(q, approach)

        shift = self._contact_shift(approach, N)
        _, distance = _vectors_between(approach.foot + shift)
        crosstalk = self._point_load / distance * (1.0 + _moments(radius, DEFLECTED, LOADING) / distance**2)  # k_ij

        # Deflection of the skin under each dome [mm], by the other domes and by the finite size of the fruit (B).
        deflection = np.einsum("pij,pj->pi", crosstalk + self._fruit.remainder, N) / self._E
        # d: a contact that moves sideways by s on a surface of relative radius R becomes shallower by s^2 / (2 R).
        slope_reduction = 0.5 * (shift**2).sum(axis=2) / approach.radius
        residual = approach.interference - slope_reduction - deflection - q
        return _DomeState(
            approach=approach,
            N=N,
            stiffness=stiffness,
            contact_radius=radius,
            strain=strain,
            crosstalk=crosstalk,
            residual=residual,
            q=q,
        )

    def _contact_shift(self, approach: DomeApproach, N: Floats) -> Floats:
        """Return the displacement of each contact on the surface [mm] that the other domes cause, (poses, tips, 3).

        The normal forces N (poses, tips) [N] of the other domes tilt the surface under a dome. The contact moves by the
        relative radius of curvature times the slope of this tilt.
        """
        # Indices: pose p, tips i and j, coordinate k.
        vectors, distance = _vectors_between(approach.foot)
        slope = self._point_load * np.einsum("pij,pijk->pik", N[:, None] / distance**3, vectors) / self._E[..., None]
        return np.asarray(approach.radius[..., None] * slope)

    def normal_compliance(self, approach: DomeApproach) -> Floats:
        """Return the compliance of the springs along the contact normals [mm/N], shape (poses, tips, tips).

        Entry ij is n_i . C_ij n_j, where C_ij is the 3 x 3 compliance between two tips, and n_i and n_j are their
        normals.
        """
        normals = approach.direction
        # The axes of C are tip i, tip j, axis a and axis b. Flattening j and b turns the contraction with n_i into one
        # matrix product per tip i.
        matrices = self._compliance.transpose(0, 2, 1, 3).reshape(len(self._compliance), 3, -1)
        along_normal = (normals.swapaxes(0, 1) @ matrices).reshape(len(self._compliance), len(normals), -1, 3)
        return np.asarray(np.einsum("ipjb,pjb->pij", along_normal, normals))

    def _local_contact(self, q: Floats, approach: DomeApproach) -> _LocalContact:
        """Return the contacts at local indentations q (poses, tips) [mm], by Hertz's law with the factor g.

        `approach` holds the radii of curvature of the contacts. Under a skin, a layered half-space replaces Hertz's
        law. A dome with q <= 0 is out of contact, and its force and stiffness are 0.
        """
        depth = np.maximum(q, 0.0) / approach.depth_ratio  # depth of the circular contact with the same force
        if self._fruit.skin_contact is not None:
            return self._local_contact_under_skin(depth, approach, self._fruit.skin_contact)
        radius = np.sqrt(approach.radius * depth)
        strain = self._large_strain(radius, approach)
        # Hertz's force is 4/3 E* a depth, and its derivative 2 E* a, because a is sqrt(R depth). The force is therefore
        # the derivative times depth / 1.5. Since g depends on a, dN/d(depth) is 2 E* a (g + dg/d(ln a) / 3).
        hertz_stiffness = 2.0 * self._E / (1.0 - self._fruit.poisson**2) * radius
        stiffness = hertz_stiffness * (strain.factor + strain.slope / 3.0) / approach.depth_ratio
        N = strain.factor * hertz_stiffness * depth / 1.5
        return _LocalContact(N=N, stiffness=stiffness, radius=radius, strain=strain)

    def _local_contact_under_skin(
        self, depth: Floats, approach: DomeApproach, skin_contact: RoundContact
    ) -> _LocalContact:
        """Return the contacts on flesh under a skin, at the given depths (poses, tips) [mm].

        `skin_contact` is the table of contacts on the layered half-space, which is solved at small strain. The
        large-strain corrections of flesh without a skin, of the force (`factor`) and of the contact radius (`edge`),
        are therefore not applied. The full sizes of these corrections are taken as the errors.
        """
        # With the radius of curvature R, the table takes depth * R. It returns force * R / E and stiffness / E.
        radius, scaled_force, scaled_stiffness = skin_contact.press(approach.radius * depth)
        without_skin = self._large_strain(radius, approach)
        # A correction of 1 is no correction, so the size of a correction is its difference from 1.
        force_error = np.abs(without_skin.factor - 1.0)
        radius_error = np.abs(without_skin.edge - 1.0)
        return _LocalContact(
            N=self._E * scaled_force / approach.radius,
            # The table holds dN/d(depth). Since depth = q / depth_ratio, dN/dq is smaller by this ratio.
            stiffness=self._E * scaled_stiffness / approach.depth_ratio,
            radius=radius,
            strain=replace(without_skin, error=force_error, edge=np.ones_like(radius), edge_error=radius_error),
        )

    def _large_strain(self, radius: Floats, approach: DomeApproach) -> LargeStrain:
        """Return the large-strain corrections of flesh without a skin, at contact radii (poses, tips) [mm]."""
        return large_strain(radius, self._poses.dome_radius, self._fruit_curvature(approach), self._fruit.poisson)

    def jacobian(self, state: _DomeState) -> Floats:
        """Return minus the Jacobian of the residual with respect to q [1], (poses, tips, tips), without small terms.

        It is I + (C + (B + k) / E) diag(dN/dq), where C is the compliance of the springs along the normals. The
        neglected terms are due to the motion of the contacts, and do not affect the equilibrium that Newton's method
        finds.
        """
        compliance = (
            self.normal_compliance(state.approach) + (state.crosstalk + self._fruit.remainder) / self._E[..., None]
        )
        return np.eye(len(self._compliance)) + compliance * state.stiffness[:, None, :]

    def bound_interference_error(self, state: _DomeState) -> Floats:
        """Return the error bound of the interference [mm] at fixed forces, shape (poses, tips).

        It is the sum of four bounds: for the compliance between contacts, for the lateral compliance of the tips, for
        the large-strain corrections, and for smaller neglected terms.
        """
        compliance_term = np.einsum("pij,pj->pi", self._compliance_bound(state), state.N) / self._E
        depth = state.contact_radius**2 / state.approach.radius
        lateral_term = self._sideways_error * self._lateral_deflection(state)
        strain_term = self.depth_change(state, state.strain.error)
        return np.asarray(compliance_term + DEPTH_FRACTION * depth + lateral_term + strain_term)

    def _compliance_bound(self, state: _DomeState) -> Floats:
        """Return the error bound of the compliance between contacts, times E [1/mm], (poses, tips, tips).

        The compliance that the fruit adds has an error of its own. In addition, the law neglects three effects: the
        variation of this compliance over a contact, its change if a contact moves, and higher moments of the crosstalk.
        """
        _, distance = _vectors_between(state.approach.foot)
        radius = state.contact_radius
        fruit = self._fruit
        size_ratio = radius[:, None] / fruit.boundary_distance
        over_contact = VARIATION_OVER_CONTACT * np.abs(fruit.remainder) * size_ratio**2
        # The next term of the crosstalk, relative to a point load, is a factor times the square of this ratio.
        moment_ratio = _moments(radius, 0.5, 0.5) / distance**2  # (a_i^2 + a_j^2) / (2 p^2), with the distance p
        next_moment = NEXT_MOMENT_FACTOR * self._point_load / distance * moment_ratio**2
        return np.asarray(fruit.bound + over_contact + next_moment + self._moved_contact_bound(state))

    def _moved_contact_bound(self, state: _DomeState) -> Floats:
        """Return the error bound of the added compliance if contacts are not at the points where it was solved.

        The bound is multiplied by E [1/mm], and has shape (poses, tips, tips). It increases with the distance of a
        contact from the point for which the compliance was solved; see `MOVED_CONTACT_FACTOR`.
        """
        fruit = self._fruit
        shift = np.linalg.norm(state.approach.foot[..., :2] - fruit.contact_points, axis=-1)
        # Upper bound on the increase in squared distance from the middle, divided by the squared boundary distance.
        increase = shift * (shift + 2.0 * np.linalg.norm(fruit.contact_points, axis=-1)) / fruit.boundary_distance**2
        larger = np.maximum(increase[:, :, None], increase[:, None, :])
        return np.asarray(MOVED_CONTACT_FACTOR * larger * np.abs(fruit.remainder))

    def _lateral_deflection(self, state: _DomeState) -> Floats:
        """Return the deflection along each normal caused by the lateral compliance of the tips [mm], (poses, tips)."""
        cosine = state.approach.cosine
        axial = cosine[:, :, None] * self._compliance[..., 2, 2] * cosine[:, None, :]
        lateral = self.normal_compliance(state.approach) - axial
        return np.asarray(np.abs(np.einsum("pij,pj->pi", lateral, state.N)))

    def rim_radius(self, state: _DomeState) -> Floats:
        """Return the contact radii of exact spheres instead of paraboloids, at the same depths [mm], (poses, tips)."""
        depth = state.contact_radius**2 / state.approach.radius
        return sphere_contact_radius(depth, self._poses.dome_radius, self._fruit_curvature(state.approach))

    def depth_change(self, state: _DomeState, fraction: Floats) -> Floats:
        """Return the change in indentation [mm] that changes each force by a relative `fraction`, (poses, tips)."""
        return fraction * state.N / np.where(state.stiffness > 0.0, state.stiffness, 1.0)

    def _fruit_curvature(self, approach: DomeApproach) -> Floats:
        """Return the curvature of the fruit [1/mm], (poses, tips), from the relative radius of curvature."""
        return 1.0 / approach.radius - 1.0 / self._poses.dome_radius


def _vectors_between(contacts: Floats) -> tuple[Floats, Floats]:
    """Return the vectors from contact j to contact i (poses, tips, tips, 3) [mm], and their lengths [mm].

    `contacts` (poses, tips, 3) [mm] are the positions of the contacts. The distance of a contact from itself is set to
    infinity, so that it has no effect on itself.
    """
    vectors = contacts[:, :, None] - contacts[:, None]
    distance = np.sqrt(np.einsum("pijk,pijk->pij", vectors, vectors))
    return vectors, distance + np.where(np.eye(distance.shape[1]) > 0.0, np.inf, 0.0)


def _moments(radius: Floats, deflected: float, loading: float) -> Floats:
    """Return deflected * a_i^2 + loading * a_j^2 (poses, tips, tips) [mm^2], for contact radii a (poses, tips) [mm]."""
    return deflected * radius[:, :, None] ** 2 + loading * radius[:, None, :] ** 2
