"""Forces of domes on springs in closed form: each presses as Hertz's sphere, and all feel each other and the body.

A dome that is pressed by q [mm] along the normal beyond what the others and the body give way carries

    N = 4/3 E* sqrt(R) q^(3/2),    E* = E / (1 - nu^2),    1 / R = 1 / r + 1 / R_fruit,

K. L. Johnson, Contact Mechanics (1985), equation (4.23), doi:10.1017/CBO9781139171731. Its interference b, what it
would enter the undeformed fruit on its spring as it stands, is

    b_i = q_i + sum_j (B_ij + k_ij) N_j / E,    k_ij = (1 - nu^2) / (pi p_ij) (1 + a_i^2 / (6 p_ij^2) + a_j^2 / (10 p_ij^2)),

with p the distance of two contacts, a their radii and B what the body adds to the half-space. The second moments are
those of the pressures: of Hertz where a force acts, of its increment, the flat punch, where it is felt. The slope that
the others make under a dome moves its contact by R times that slope. The force along the spring is N times the cosine
of the normal to the axis. A dome that is off has q <= 0 and no force: one smooth system, solved by Newton's method.
"""

from dataclasses import dataclass

import numpy as np

from solve.arrays import Floats
from solve.contact.dome_geometry import DomeApproach, DomePoses
from solve.linear import SolveError

MOST_STEPS = 60
HALVINGS = 12
RESIDUAL_LIMIT = 1e-11  # of the largest interference: round-off of coordinates a hundred times as large


@dataclass(frozen=True, eq=False)
class Body:
    """The fruit under the domes: Poisson's ratio [1], and what it adds to a half-space.

    `remainder` (poses, tips, tips), times E [1/mm], is that of the compliance; `bound` (poses, tips, tips), as the
    remainder, how far that may be off; `size` [mm] the nearest distance to what bounds the fruit.
    """

    poisson: float
    remainder: Floats
    bound: Floats
    size: float


@dataclass(frozen=True, eq=False)
class DomeForces:
    """Forces F of the domes along their springs [N], (poses, tips), and what they do, each as F.

    `rates` [N/mm] are their slopes over the travel, `error` [N] how far each may be off; `contact_radius` [mm] and
    `mean_pressure` [MPa] are those of the contacts, `face` [mm] is the width of a face that would hold each.
    """

    F: Floats
    rates: Floats
    error: Floats
    contact_radius: Floats
    mean_pressure: Floats
    face: Floats


@dataclass(frozen=True, eq=False)
class _State:
    """Domes at trial depths: their approach, normal forces N and slopes of these, contact radii, and the residual."""

    approach: DomeApproach
    N: Floats
    stiffness: Floats
    contact_radius: Floats
    action: Floats
    residual: Floats


def dome_forces(poses: DomePoses, E: Floats, C: Floats, body: Body) -> DomeForces:
    """Return the forces of domes at moduli E (poses,) [MPa] on springs of compliance C (tips, tips) [mm/N].

    Raises SolveError where the forces do not settle.
    """
    law = _Law(poses, E, C, body)
    q = law.solved()
    state = law.at(q)
    inverse = np.linalg.inv(law.jacobian(state))
    sunk = np.einsum("pk,pik->pi", poses.axis * [0.0, 0.0, 1.0], state.approach.normal)
    cosine = state.approach.cosine
    rates = state.stiffness * np.einsum("pij,pj->pi", inverse, sunk)
    errors = state.stiffness * np.einsum("pij,pj->pi", np.abs(inverse), law.bound(state))
    area = np.pi * state.contact_radius**2
    leaning = poses.dome_radius * np.sqrt(np.maximum(1.0 - cosine**2, 0.0))
    touching = state.N > 0.0
    return DomeForces(
        F=cosine * state.N,
        rates=np.where(touching, cosine * rates, 0.0),
        error=cosine * errors,
        contact_radius=state.contact_radius,
        mean_pressure=np.divide(state.N, area, out=np.zeros_like(area), where=touching),
        face=np.where(touching, 2.0 * (leaning + state.contact_radius), 0.0),
    )


class _Law:
    """The equations of the domes for the depths q (poses, tips) [mm], negative where a dome is off."""

    def __init__(self, poses: DomePoses, E: Floats, C: Floats, body: Body) -> None:
        self._poses, self._C, self._body = poses, C, body
        self._E = E[:, None]
        self._k = (1.0 - body.poisson**2) / np.pi
        self._level = poses.approach(np.zeros(poses.centres.shape[:2]))

    def solved(self) -> Floats:
        """Return the depths; raises SolveError where Newton's method with halved steps does not settle."""
        q = self._level.interference.copy()
        state = self.at(q)
        allowed = RESIDUAL_LIMIT * np.abs(self._poses.centres).max()
        for _ in range(MOST_STEPS):
            worst = np.abs(state.residual).max(axis=1)
            if worst.max(initial=0.0) <= allowed:
                return q
            step = np.linalg.solve(self.jacobian(state), state.residual[..., None])[..., 0]
            share = np.ones((len(q), 1))
            for _ in range(HALVINGS):
                trial = self.at(q + share * step)
                grown = np.abs(trial.residual).max(axis=1) > np.maximum(worst, allowed)
                if not grown.any():
                    break
                share[grown] *= 0.5
            q, state = q + share * step, trial
        msg = f"domes: residual {np.abs(state.residual).max():.1e} mm must be at most {allowed:.0e} mm; press less deep"
        raise SolveError(msg)

    def at(self, q: Floats) -> _State:
        """Return the domes at trial depths q (poses, tips) [mm]."""
        N, stiffness, radius = self._hertz(q, self._level.radius)
        approach = self._poses.approach((self._level.cosine * N) @ self._C.T)
        N, stiffness, radius = self._hertz(q, approach.radius)
        action, moved = self._action(approach, N, radius)
        sunk = np.einsum("pij,pj->pi", action + self._body.remainder, N) / self._E
        residual = approach.interference - 0.5 * moved / approach.radius - sunk - q
        return _State(approach, N, stiffness, radius, action, residual)

    def _hertz(self, q: Floats, R: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the normal forces [N], their slopes over the depth [N/mm] and the contact radii [mm]."""
        pressed = np.maximum(q, 0.0)
        contact = np.sqrt(R * pressed)
        stiffness = 2.0 * self._E / (1.0 - self._body.poisson**2) * contact
        return stiffness * pressed / 1.5, stiffness, contact

    def _action(self, approach: DomeApproach, N: Floats, radius: Floats) -> tuple[Floats, Floats]:
        """Return k_ij (poses, tips, tips) [1/mm], and the squares of how far the contacts are moved [mm^2]."""
        place = approach.place
        between, distance = _between(place)
        slope = np.einsum("pij,pijk,pj->pik", self._k / distance**3, between, N) / self._E[..., None]
        moved = approach.radius[..., None] * slope
        _, distance = _between(place + moved)
        moments = radius[:, :, None] ** 2 / 6.0 + radius[:, None, :] ** 2 / 10.0
        action = self._k / distance * (1.0 + moments / distance**2)
        return action, (moved**2).sum(axis=2)

    def jacobian(self, state: _State) -> Floats:
        """Return minus the slope of the residual over the depths [1], (poses, tips, tips), but for its small parts."""
        cosine = state.approach.cosine
        springs = cosine[:, :, None] * self._C * cosine[:, None, :]
        given = springs + (state.action + self._body.remainder) / self._E[..., None]
        return np.asarray(np.eye(len(self._C)) + given * state.stiffness[:, None, :])

    def bound(self, state: _State) -> Floats:
        """Return how far the interference that belongs to the forces may be off [mm], (poses, tips)."""
        sunk = np.einsum("pij,pj->pi", self._body.bound, state.N) / self._E
        return sunk


def _between(place: Floats) -> tuple[Floats, Floats]:
    """Return the vectors from contact j to contact i [mm] and their lengths, infinite from one to itself."""
    between = place[:, :, None] - place[:, None]
    distance = np.linalg.norm(between, axis=-1)
    return between, distance + np.where(np.eye(distance.shape[1]) > 0.0, np.inf, 0.0)
