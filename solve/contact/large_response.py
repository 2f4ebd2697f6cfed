"""What a level sensor with flat tips reads where they go deep: the force of each tip from its curve at large strain.

A tip that enters by d carries F = E / s g(d) d, with s its own compliance times E and g the factor of its curve. What
the others push the skin away under it is linear: x = C F + d + (S - diag S) F / E.
"""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cad.quantity import validation_error
from solve.arrays import Floats
from solve.contact.linear_response import SensorResponse, response_of_forces
from solve.contact.scene import Scene
from solve.error_estimate import SolveInfo
from solve.fruit.compliance import FruitCompliance
from solve.large_strain.flesh_law import FleshLaw
from solve.large_strain.force_curve import ForceCurve
from solve.large_strain.tip_profile import RoundTip
from solve.linear import SolveError

# Fractions of a force, not recomputed here: 3-D finite elements of a square tip, sharp or with a fillet, against the
# circle of equal area, and of two tips against linear crosstalk.
SQUARE_SHARP = 2e-3
SQUARE_ROUNDED = 5e-3
CROSSTALK = 1.1e-3
# A body twice as wide and high, log neo-Hooke: sharp, and more by the fraction of the radius that is rounded.
FINITE_BODY = 1e-3
OF_ROUNDED = 1.6e-2
MOST_ITERATIONS = 30
RESIDUAL_LIMIT = 1e-12  # of the travel


def round_tip(scene: Scene) -> RoundTip:
    """Return the round tip with the area of the scene's tips [tip sides]; its edge is wider by as much as a square."""
    tips = scene.tips
    radius = 0.5 if tips.tip_shape.is_round else 1.0 / math.sqrt(math.pi)
    return RoundTip(radius=radius, edge=2.0 * radius * tips.fillet_mm / tips.side_mm)


def check_large_strain(scene: Scene) -> FleshLaw:
    """Return the law of the scene's flesh; raises InputError where large strain is not solved."""
    level = scene.press.tilt_deg == 0.0 and scene.press.roll_deg == 0.0
    if not (level and scene.fruit.shape == "block" and scene.tips.tip_shape.has_flat_face):
        bound = "'linear' but for level cubes or cylinders on a block"
        raise validation_error("press.strain", "large", "", bound, "press level with flat tips, or take 'linear'")
    return FleshLaw(poisson=scene.fruit.poisson)


def large_response(
    scene: Scene, compliance: FruitCompliance, C: Floats, curve: ForceCurve, E: Sequence[float] | Floats, x: Floats
) -> SensorResponse:
    """Return forces, P and slope ratio over moduli [MPa] and travels [mm]; C (tips, tips) [mm/N] is the springs'.

    Raises InputError where a tip goes deeper than the curve, SolveError where forces and travel do not agree.
    """
    start = time.perf_counter()
    moduli = np.asarray(E, dtype=np.float64)
    x = np.asarray(x, dtype=np.float64)
    balance = _Balance(
        curve=curve,
        side=scene.tips.side_mm,
        travel=x[:, None] + np.asarray(scene.height_offsets_mm),
        stiffness=(moduli[:, None] / np.diag(compliance.S))[:, None],
        beside=(C + (compliance.S - np.diag(np.diag(compliance.S))) / moduli[:, None, None])[:, None],
    )
    depth = balance.depths()
    F, slope = balance.force(depth)
    rates = slope * np.linalg.solve(balance.tangent(slope), np.ones_like(depth)[..., None])[..., 0]
    info = SolveInfo(
        method="large strain",
        dofs=0,
        seconds=time.perf_counter() - start,
        status=f"log neo-Hooke without slip, {curve.info.status}; the grip at first touch counts as none",
    )
    groups = scene.tips.spring_groups
    response = response_of_forces(moduli, x, F, rates, groups, info)

    # d ln F / d ln g: a stiff spring passes all of the flesh's error on to its force, a soft one little.
    own_compliance = np.einsum("...ii->...i", balance.beside)
    passed_on = 1.0 / (1.0 + own_compliance * slope)
    errors = passed_on * flesh_error(scene, curve, np.maximum(depth / balance.side, 0.0))
    low = errors[..., list(groups.low)].max(axis=2)
    high = errors[..., list(groups.high)].max(axis=2)
    return replace(
        response,
        F_error=response.F_error + errors.max(axis=2) + compliance.error_pair,
        P_error=response.P_error + low + high + compliance.error_pair,
        # One curve serves all tips: where it is off, P moves by how much more the high springs' forces do.
        P_step=high - low,
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Balance:
    """Depth + beside F(depth) = travel: what springs and other tips, `beside`, leave of the travel of each tip.

    `travel` (travels, tips) [mm], `stiffness` of the flesh at first touch (moduli, 1, tips) [N/mm], `beside` (moduli,
    1, tips, tips) [mm/N].
    """

    curve: ForceCurve
    side: float
    travel: Floats
    stiffness: Floats
    beside: Floats

    def force(self, depths: Floats) -> tuple[Floats, Floats]:
        """Return forces [N] and their slopes over the depth [N/mm] at depths [mm], all (moduli, travels, tips)."""
        force, slope = self.curve.force(depths / self.side)
        return np.asarray(self.side * self.stiffness * force), np.asarray(self.stiffness * slope)

    def tangent(self, slope: Floats) -> Floats:
        """Return the derivative of the balance (moduli, travels, tips, tips) [1]."""
        return np.eye(slope.shape[-1]) + self.beside * slope[..., None, :]

    def depths(self) -> Floats:
        """Return the depths [mm] by Newton's method; raises SolveError, and InputError beyond the curve."""
        linear = np.broadcast_to(self.travel, (len(self.stiffness), *self.travel.shape))
        slope = np.broadcast_to(self.stiffness, linear.shape)
        depths: Floats = np.linalg.solve(self.tangent(slope), linear[..., None])[..., 0].astype(np.float64)
        for _ in range(MOST_ITERATIONS):
            force, slope = self.force(depths)
            residual = depths + (self.beside @ force[..., None])[..., 0] - self.travel
            if np.abs(residual).max() <= RESIDUAL_LIMIT * np.abs(self.travel).max():
                self.curve.factor(np.maximum(depths / self.side, 0.0))  # refuses what is beyond the curve
                return depths
            depths = depths - np.linalg.solve(self.tangent(slope), residual[..., None])[..., 0]
        msg = "large strain: springs and flesh found no equilibrium; check springs and travel"
        raise SolveError(msg)


def flesh_error(scene: Scene, curve: ForceCurve, depth: Floats) -> Floats:
    """Return the relative error of the flesh's force [1] at depths [tip sides], of the same shape."""
    tip = round_tip(scene)
    idealised = CROSSTALK + FINITE_BODY + OF_ROUNDED * tip.edge / tip.radius
    if not scene.tips.tip_shape.is_round:
        idealised += SQUARE_ROUNDED if scene.tips.fillet_mm > 0.0 else SQUARE_SHARP
    return curve.error(depth) / curve.factor(depth) + idealised
