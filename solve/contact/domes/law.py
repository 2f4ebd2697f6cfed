"""The dome law: forces of domes on springs, by Hertz contacts that interact with each other and with the finite fruit.

Let q [mm] be the local indentation of a dome along the normal: its depth minus the deflection due to the other domes
and to the finite size of the fruit. Its normal force is

    N = 4/3 g E* sqrt(R) q^(3/2),    E* = E / (1 - nu^2),    1 / R = 1 / r + 1 / R_fruit,

by K. L. Johnson, Contact Mechanics (1985), equation (4.23), doi:10.1017/CBO9781139171731, with the factor g for large
strain (`large_strain.py`). The interference b of a dome is its depth in the undeformed fruit for the actual deflection
of its spring,

    b_i = q_i + sum_j (B_ij + k_ij) N_j / E,
    k_ij = (1 - nu^2) / (pi p) (1 + a_i^2 / (6 p^2) + a_j^2 / (10 p^2)),

with the distance p of two contacts, their radii a, and the compliance B that the finite fruit has in addition to a
half-space, along the normals at the contacts. The factors of a^2 are second moments of pressures. At the loading
contact j it is Hertz's pressure. At the deflected contact i it is the pressure of a flat punch, which is the increment
of Hertz's pressure.

The other domes tilt the surface under a dome by a slope, which moves its contact by R times the slope. The force along
the spring is N times the cosine of the angle between normal and axis. The transverse component of N moves the dome
laterally, according to the compliance of the housing. A dome out of contact has q <= 0 and no force. These equations
are a smooth system, which is solved by Newton's method. Friction is neglected. The flesh is neo-Hookean; the difference
of other laws is reported separately. Under a skin, N is the force on a layered half-space at small strain
(`solve/halfspace/layered.py`). The whole effect of large strain is then part of the error.
"""

from dataclasses import dataclass, replace

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

# Mean of x^2 - y^2 / 2 [contact radii^2]: over the flat punch at the deflected contact, and over Hertz's pressure at
# the loading contact.
DEFLECTED = 1.0 / 6.0
LOADING = 1.0 / 10.0
MOST_STEPS = 60  # maximum number of Newton steps
STEPS_ALONE = 5  # Newton steps for each dome without the others, to find an initial guess
HALVINGS = 12  # maximum number of halvings of a Newton step
# Relative change in the added compliance if the contacts are not where it was solved. It is per increase of their
# squared distance from the middle, over the squared size of the fruit (tests/reference/fits/test_contact.py).
ELSEWHERE = 2.0
# Factors in the bounds on neglected terms, which tests/solve/contact/domes/test_law.py compares with cells. The first
# is the variation of the added deflection over a contact, times (a / size)^2, and the second the next moments of the
# crosstalk. The third is all other terms, as a fraction of the depth.
OVER_CONTACT = 0.25
NEXT_MOMENT = 0.5
OF_DEPTH = 7e-4
RESIDUAL_LIMIT = 1e-12  # largest residual over the largest coordinate of a dome, unless round-off is larger
# Round-off over the largest semi-axis, because contacts are computed from the centre of the fruit; up to 3 epsilon was
# observed.
ROUND_OFF = 10.0 * float(np.finfo(np.float64).eps)


@dataclass(frozen=True, eq=False)
class DomeForces:
    """The forces F of the domes along their springs [N], with errors and contacts; all arrays are (poses, tips).

    `rates` [N/mm] are the derivatives of F by the travel. `error` [N] bounds the error of each force on neo-Hookean
    flesh. `common_error` [N] is the error of all forces together if it has the same sign under all domes, as for a
    softer fruit. `flesh` [N] is the increase of F with Hencky's law of flesh, and the decrease with Storakers's law.
    `contact_radius` [mm] and `mean_pressure` [MPa] are those of the deformed contacts. `pressure_error` [1] is the
    relative error of the pressure due to the contact radius only. `face` [mm] is the diameter of the smallest face that
    contains the contact.
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
        """Return the relative error of each nonzero force [1], 0 for the others, (poses, tips)."""
        touching = self.F > 0.0
        return np.where(touching, self.error / np.where(touching, self.F, 1.0), 0.0)


@dataclass(frozen=True, eq=False)
class _DomeState:
    """The domes for trial values q (poses, tips) [mm] of the local indentation; see the module docstring.

    `N` [N] are the normal forces, and `stiffness` [N/mm] their derivatives by q. `contact_radius` [mm] are Hertz's
    contact radii. `action` (poses, tips, tips) [1/mm] is k_ij. `residual` [mm] is the residual of the equation for b_i.
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
    """Return the forces of domes at moduli E (poses,) [MPa], on springs with the compliance C (tips, tips) [mm/N].

    `body` has the compliance that the fruit has in addition to a half-space, in the same poses. Raises SolveError if
    Newton's method does not converge.
    """
    law = _Law(poses, E, C, body)
    state = law.equilibrium()
    cosine = state.approach.cosine
    touching = state.N > 0.0
    contact_radius = state.contact_radius * state.strain.edge
    # The derivative of the force along spring i by the interference of dome j [N/mm].
    gain = (cosine * state.stiffness)[..., None] * np.linalg.inv(law.jacobian(state))
    bound = law.bound(state)
    flesh = law.depth_change(state, state.strain.law_spread)
    face = 2.0 * (poses.from_face_middle(state.approach) + law.rim_radius(state))
    return DomeForces(
        F=cosine * state.N,
        rates=np.where(touching, np.einsum("pij,pj->pi", gain, state.approach.normal[..., 2]), 0.0),
        error=np.einsum("pij,pj->pi", np.abs(gain), bound),
        common_error=np.einsum("pij,pj->pi", gain, bound),  # the errors of all interferences have the same sign
        flesh=np.einsum("pij,pj->pi", gain, flesh),
        contact_radius=contact_radius,
        mean_pressure=state.N / np.where(touching, np.pi * contact_radius**2, 1.0),
        pressure_error=np.where(touching, 2.0 * state.strain.edge_error, 0.0),
        face=np.where(touching, face, 0.0),
    )


@dataclass(frozen=True, eq=False)
class DomeContrast:
    """The constants of level domes in the contrast law (`sensor/theory/contrast_law.py`), for forces along the springs.

    `S` (tips, tips) [1/mm] is the compliance of the fruit without Hertz's part, times E. `hertz` [mm (MPa/N)^(2/3)] is
    the mean over the tips of h in h (F / E)^(2/3). `lean` (tips, tips) [mm/N] is added to the compliance of the
    springs. Contact forces are inclined on the slope of the fruit, and also move the tips laterally.
    """

    S: Floats
    hertz: float
    lean: Floats


def dome_contrast(scene: Scene, compliance: FruitCompliance, C: Floats, E: float) -> DomeContrast:
    """Return the constants of domes in the contrast law, from a level press to full travel at the modulus E [MPa].

    C (tips, tips) [mm/N] is the compliance of the springs. Normal forces are converted to forces along the springs by
    the cosines of their angles to the axis. Raises SolveError if Newton's method does not converge, or if a dome does
    not touch, because its constants are then unknown.
    """
    level = replace(scene, press=replace(scene.press, tilt_deg=0.0, roll_deg=0.0), off_centre_mm=(0.0, 0.0))
    body = fruit_under_domes(scene, compliance, [scene.fruit])
    law = _Law(dome_poses([level], np.array([scene.press.travel_mm])), np.array([E]), C, body)
    state = law.equilibrium()
    untouched = int((state.N[0] <= 0.0).sum())
    if untouched:
        hint = "press deeper, or take stiffer springs or a softer skin"
        msg = f"domes: {untouched} of {len(C)} do not touch at full travel of a level press: all must touch; {hint}"
        raise SolveError(msg)
    cosine = state.approach.cosine[0]
    hertz = state.q[0] / cosine * (E / (cosine * state.N[0])) ** (2.0 / 3.0)
    return DomeContrast(
        S=(body.remainder + state.action)[0] / np.outer(cosine, cosine),
        hertz=float(np.mean(hertz)),
        lean=law.normal_compliance(state.approach)[0] / np.outer(cosine, cosine) - C,
    )


class _Law:
    """The equations of the dome law, whose unknowns are the local indentations q (poses, tips) [mm].

    An indentation is negative for a dome out of contact.
    """

    def __init__(self, poses: DomePoses, E: Floats, C: Floats, body: FruitUnderDomes) -> None:
        """Store the arguments of `dome_forces`, and the compliance of the springs in three dimensions."""
        self._poses = poses
        sideways = poses.sideways or LateralCompliance(np.zeros((*C.shape, 3, 3)), 0.0)
        self._springs = C
        self._C = sideways.compliance.copy()  # (tips, tips, 3, 3) [mm/N], in the frame of the sensor
        self._C[..., 2, 2] += C
        self._sideways_error = sideways.error
        self._body = body
        self._E = E[:, None]
        self._point_load = (1.0 - body.poisson**2) / np.pi  # deflection by a point load, times E distance / force [1]

    def equilibrium(self) -> _DomeState:
        """Return the domes in equilibrium, by Newton's method with halved steps.

        A step is halved in the poses whose residual it would increase. Raises SolveError without convergence.
        """
        unmoved = self._poses.approach(np.zeros(self._poses.centres.shape))
        state = self.state(self._independent_indentations(unmoved), unmoved)
        tolerance = self._residual_tolerance()
        for _ in range(MOST_STEPS):
            if np.abs(state.residual).max(initial=0.0) <= tolerance:
                return state
            largest = np.maximum(np.abs(state.residual).max(axis=1), tolerance)
            step = np.linalg.solve(self.jacobian(state), state.residual[..., None])[..., 0]
            trial = self.state(state.q + step, state.approach)
            increased = np.flatnonzero(np.abs(trial.residual).max(axis=1) > largest)
            state = self._take_halved_step(state, np.asarray(step), increased, largest) if increased.size else trial
        residual = np.abs(state.residual).max()
        hint = "press less deep, or take stiffer springs"
        msg = f"domes: residual {residual:.1e} mm must be at most {tolerance:.0e} mm; {hint}"
        raise SolveError(msg)

    def _residual_tolerance(self) -> float:
        """Return the residual at convergence [mm], which is above the round-off of the contact positions."""
        semi_axes = self._poses.semi_axes
        round_off = ROUND_OFF * semi_axes.max(initial=0.0, where=np.isfinite(semi_axes))
        return max(RESIDUAL_LIMIT * float(np.abs(self._poses.centres).max()), float(round_off))

    def _independent_indentations(self, unmoved: DomeApproach) -> Floats:
        """Return approximate indentations q [mm] of each dome on its own spring, without the other domes.

        Newton's method starts from the undeformed fruit, and converges monotonically because the force is a convex
        function of the indentation.
        """
        compliance = np.einsum("pii->pi", self.normal_compliance(unmoved))
        q = unmoved.interference
        for _ in range(STEPS_ALONE):
            N, stiffness, _, _ = self._hertz(q, unmoved)
            q = q - (q + compliance * N - unmoved.interference) / (1.0 + compliance * stiffness)
        return np.asarray(q)

    def _take_halved_step(self, state: _DomeState, step: Floats, increased: Ints, largest: Floats) -> _DomeState:
        """Return the state after a step (poses, tips) [mm] that is halved in some poses.

        `increased` are the indices of the poses whose residual the full step increases. Their step is halved until
        their residual is at most `largest` (poses,) [mm], but at most HALVINGS times. `step` is changed in place.
        """
        for _ in range(HALVINGS):
            step[increased] *= 0.5
            subset = _Law(
                self._poses.select(increased), self._E[increased, 0], self._springs, self._body.select(increased)
            )
            trial = subset.state(state.q[increased] + step[increased], state.approach.select(increased))
            increased = increased[np.abs(trial.residual).max(axis=1) > largest[increased]]
            if not increased.size:
                break
        return self.state(state.q + step, state.approach)

    def state(self, q: Floats, previous: DomeApproach) -> _DomeState:
        """Return the domes for trial indentations q (poses, tips) [mm], with the residual of the equations.

        The springs deflect under forces along the normals of the `previous` approach. At equilibrium these normals
        agree with the new ones.
        """
        N = self._hertz(q, previous)[0]
        displacements = np.tensordot(N[..., None] * previous.direction, self._C, axes=((1, 2), (1, 3)))
        approach = self._poses.approach(displacements)
        N, stiffness, radius, strain = self._hertz(q, approach)

        # The other domes tilt the surface under a dome by `slope`. This moves its contact by `shift`, the relative
        # radius of curvature times the slope, and reduces its interference.
        vectors, distance = _vectors_between(approach.foot)
        slope = self._point_load * np.einsum("pij,pijk->pik", N[:, None] / distance**3, vectors) / self._E[..., None]
        shift = approach.radius[..., None] * slope
        _, distance = _vectors_between(approach.foot + shift)
        action = self._point_load / distance * (1.0 + _moments(radius, DEFLECTED, LOADING) / distance**2)  # k_ij

        deflection = np.einsum("pij,pj->pi", action + self._body.remainder, N) / self._E
        slope_reduction = 0.5 * (shift**2).sum(axis=2) / approach.radius
        residual = approach.interference - slope_reduction - deflection - q
        return _DomeState(approach, N, stiffness, radius, strain, action, residual, q)

    def normal_compliance(self, approach: DomeApproach) -> Floats:
        """Return the compliance of the springs along the normals of the contacts [mm/N], (poses, tips, tips).

        Entry ij is n_i . C_ij n_j, with the 3 x 3 compliance C_ij between two tips and the normals n.
        """
        normals = approach.direction
        # With the axes of tip i last but one, the product with n_i is one matrix product for each dome.
        matrices = self._C.transpose(0, 2, 1, 3).reshape(len(self._C), 3, -1)
        along_normal = (normals.swapaxes(0, 1) @ matrices).reshape(len(self._C), len(normals), -1, 3)
        return np.asarray(np.einsum("ipjb,pjb->pij", along_normal, normals))

    def _hertz(self, q: Floats, approach: DomeApproach) -> tuple[Floats, Floats, Floats, LargeStrain]:
        """Return the normal forces N [N], dN/dq [N/mm], Hertz's contact radii [mm], and corrections for large strain.

        All are for the local indentations q (poses, tips) [mm].
        """
        depth = np.maximum(q, 0.0) / approach.depth_ratio  # of the round contact with the same force
        if self._body.skinned is not None:
            return self._layered_hertz(depth, approach, self._body.skinned)
        contact = np.sqrt(approach.radius * depth)
        strain = self._large_strain(contact, approach)
        stiffness = 2.0 * self._E / (1.0 - self._body.poisson**2) * contact  # by Hertz, force = stiffness depth / 1.5
        # With g, dN/d(depth) = stiffness (g + dg/d(ln a) / 3), because a is proportional to the root of the depth.
        slope = stiffness * (strain.factor + strain.slope / 3.0) / approach.depth_ratio
        return strain.factor * stiffness * depth / 1.5, slope, contact, strain

    def _layered_hertz(
        self, depth: Floats, approach: DomeApproach, skinned: RoundContact
    ) -> tuple[Floats, Floats, Floats, LargeStrain]:
        """Return the results of `_hertz` for flesh under a skin, at the given depths [mm].

        The layered half-space is solved at small strain. So the whole correction for large strain of flesh without a
        skin becomes a part of the error.
        """
        contact, force, stiffness = skinned.press(approach.radius * depth)
        without_skin = self._large_strain(contact, approach)
        one = np.ones_like(contact)
        error = np.abs(without_skin.factor - one)
        strain = replace(without_skin, error=error, edge=one, edge_error=np.abs(without_skin.edge - one))
        return self._E * force / approach.radius, self._E * stiffness / approach.depth_ratio, contact, strain

    def _large_strain(self, contact: Floats, approach: DomeApproach) -> LargeStrain:
        """Return the corrections for large strain of flesh without a skin, at contact radii (poses, tips) [mm]."""
        return large_strain(contact, self._poses.dome_radius, self._fruit_curvature(approach), self._body.poisson)

    def jacobian(self, state: _DomeState) -> Floats:
        """Return minus the derivative of the residual by q [1], (poses, tips, tips), without small terms."""
        compliance = self.normal_compliance(state.approach) + (state.action + self._body.remainder) / self._E[..., None]
        return np.eye(len(self._C)) + compliance * state.stiffness[:, None, :]

    def bound(self, state: _DomeState) -> Floats:
        """Return the error bound of the interference for given forces [mm], (poses, tips).

        It is the sum of four terms: the errors of the compliance, a fraction of the depth, the error of the lateral
        compliance, and the error of the corrections for large strain.
        """
        _, distance = _vectors_between(state.approach.foot)
        radius = state.contact_radius
        body = self._body
        # Besides the error of the added compliance, its variation over a contact, the next moments of the crosstalk,
        # and the effect of other contact points are neglected.
        over_contact = OVER_CONTACT * np.abs(body.remainder) * (radius[:, None] / body.size) ** 2
        next_moment = NEXT_MOMENT * self._point_load / distance * (_moments(radius, 0.5, 0.5) / distance**2) ** 2
        compliance_bound = body.bound + over_contact + next_moment + self._moved_contact_bound(state)
        compliance_term = np.einsum("pij,pj->pi", compliance_bound, state.N) / self._E
        depth = radius**2 / state.approach.radius
        lateral_term = self._sideways_error * self._lateral_deflection(state)
        strain_term = self.depth_change(state, state.strain.error)
        return np.asarray(compliance_term + OF_DEPTH * depth + lateral_term + strain_term)

    def _moved_contact_bound(self, state: _DomeState) -> Floats:
        """Return the error bound [1/mm] of the added compliance if contacts are not at the points where it was solved.

        The shape is (poses, tips, tips), and the bound is times E.
        """
        body = self._body
        shift = np.linalg.norm(state.approach.foot[..., :2] - body.feet, axis=-1)
        # The largest possible increase of the squared distance from the middle, over the squared size.
        increase = shift * (shift + 2.0 * np.linalg.norm(body.feet, axis=-1)) / body.size**2
        larger = np.maximum(increase[:, :, None], increase[:, None, :])
        return np.asarray(ELSEWHERE * larger * np.abs(body.remainder))

    def _lateral_deflection(self, state: _DomeState) -> Floats:
        """Return the deflection along each normal due to the lateral compliance of the tips [mm], (poses, tips)."""
        cosine = state.approach.cosine
        axial = cosine[:, :, None] * self._C[..., 2, 2] * cosine[:, None, :]
        lateral = self.normal_compliance(state.approach) - axial
        return np.asarray(np.abs(np.einsum("pij,pj->pi", lateral, state.N)))

    def rim_radius(self, state: _DomeState) -> Floats:
        """Return the contact radii of exact spheres, instead of paraboloids, at the same depths [mm], (poses, tips)."""
        depth = state.contact_radius**2 / state.approach.radius
        return sphere_contact_radius(depth, self._poses.dome_radius, self._fruit_curvature(state.approach))

    def depth_change(self, state: _DomeState, fraction: Floats) -> Floats:
        """Return the change in indentation that changes each force by a relative `fraction` [mm], (poses, tips)."""
        return fraction * state.N / np.where(state.stiffness > 0.0, state.stiffness, 1.0)

    def _fruit_curvature(self, approach: DomeApproach) -> Floats:
        """Return the relative curvature minus the curvature of the dome: that of the fruit [1/mm], (poses, tips)."""
        return 1.0 / approach.radius - 1.0 / self._poses.dome_radius


def _vectors_between(feet: Floats) -> tuple[Floats, Floats]:
    """Return the vectors from contact j to contact i (poses, tips, tips, 3) [mm], and their lengths.

    `feet` (poses, tips, 3) [mm] are the contacts. The distance of a contact from itself is infinite, so that it has no
    effect on itself.
    """
    vectors = feet[:, :, None] - feet[:, None]
    distance = np.sqrt(np.einsum("pijk,pijk->pij", vectors, vectors))
    return vectors, distance + np.where(np.eye(distance.shape[1]) > 0.0, np.inf, 0.0)


def _moments(radius: Floats, deflected: float, loading: float) -> Floats:
    """Return deflected * a_i^2 + loading * a_j^2 (poses, tips, tips) [mm^2] for contact radii a (poses, tips) [mm]."""
    return deflected * radius[:, :, None] ** 2 + loading * radius[:, None, :] ** 2
