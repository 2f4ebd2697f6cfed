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
from solve.contact.linear_response import SensorResponse, TipKinds, response_of_forces
from solve.contact.scene import Scene
from solve.error_estimate import SolveInfo
from solve.fruit.compliance import FruitCompliance
from solve.large_strain.flesh_law import FleshLaw
from solve.large_strain.force_curve import ForceCurve
from solve.large_strain.tip_profile import FlatTip
from solve.linear import SolveError

# Shares of a force, not recomputed here: 3-D finite elements of a square tip, sharp or with a fillet, against the
# circle of equal area, and of two tips against linear crosstalk.
SQUARE_SHARP, SQUARE_ROUNDED, CROSSTALK = 2e-3, 5e-3, 1.1e-3
# A body twice as wide and high, log neo-Hooke: sharp, and more by the share of the radius that is rounded.
FINITE_BODY, OF_ROUNDED = 1e-3, 1.6e-2
MOST_ITERATIONS = 30
RESIDUAL_LIMIT = 1e-12  # of the travel


def round_tip(scene: Scene) -> FlatTip:
    """Return the round tip with the area of the scene's tips [tip sides]; its edge is wider by as much as a square."""
    tips = scene.tips
    radius = 0.5 if tips.tip_shape.is_round else 1.0 / math.sqrt(math.pi)
    return FlatTip(radius=radius, edge=2.0 * radius * tips.fillet_mm / tips.side_mm)


def check_large_strain(scene: Scene) -> FleshLaw:
    """Return the law of the scene's flesh; raises InputError where large strain is not solved."""
    level = scene.press.tilt_deg == 0.0 and scene.press.roll_deg == 0.0
    if not (level and scene.fruit.shape == "block" and scene.tips.tip_shape.has_flat_face):
        bound = "'linear' but for level cubes or cylinders on a block"
        raise validation_error("press.strain", "large", "", bound, "press level with flat tips, or take 'linear'")
    return FleshLaw(poisson=scene.fruit.poisson)


def large_response(
    scene: Scene,
    compliance: FruitCompliance,
    C: Floats,
    curve: ForceCurve,
    over: tuple[Sequence[float] | Floats, Floats],
) -> SensorResponse:
    """Return forces, P and slope ratio over moduli [MPa] and travels [mm]; C (tips, tips) [mm/N] is the springs'.

    Raises InputError where a tip goes deeper than the curve, SolveError where forces and travel do not agree.
    """
    start = time.perf_counter()
    moduli, x = (np.asarray(values, dtype=np.float64) for values in over)
    state = _pressed(scene, compliance, C, curve, (moduli, x))
    own = flesh_error(scene, curve, state.depth)
    info = SolveInfo(
        method="large strain",
        dofs=0,
        seconds=time.perf_counter() - start,
        status=f"log neo-Hooke without slip, {curve.info.status}; the grip at first touch counts as none",
    )
    response = response_of_forces(moduli, x, state.F, state.rates, TipKinds(*scene.tips.kinds), info)
    shares = state.fruit_share * own
    known = compliance.error_pair
    soft, stiff = (shares[..., list(kind)].max(axis=2) for kind in scene.tips.kinds)
    return replace(
        response,
        F_error=response.F_error + shares.max(axis=2) + known,
        P_error=response.P_error + soft + stiff + known,
        # One curve serves all tips: where it is off, P moves by what the stiff ones answer more than the soft ones.
        P_step=stiff - soft,
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Pressed:
    """Depths [tip sides], forces [N], their slopes over the travel [N/mm], d ln F / d ln g: (moduli, travels, tips)."""

    depth: Floats
    F: Floats
    rates: Floats
    fruit_share: Floats


def _pressed(
    scene: Scene, compliance: FruitCompliance, C: Floats, curve: ForceCurve, over: tuple[Floats, Floats]
) -> _Pressed:
    """Return the equilibrium of springs and flesh, by Newton's method on the depths of the tips."""
    moduli, x = over
    own = np.diag(compliance.S)
    others = (C + (compliance.S - np.diag(own)) / moduli[:, None, None])[:, None]
    balance = _Balance(
        curve=curve,
        side=scene.tips.side_mm,
        reach=x[:, None] + np.asarray(scene.ahead),
        stiffness=(moduli[:, None] / own)[:, None],
        others=others,
    )
    depths = balance.depths()
    force, slope = balance.force(depths)
    rates = slope * np.linalg.solve(balance.tangent(slope), np.ones_like(depths)[..., None])[..., 0]
    springs = np.einsum("...ii->...i", others) * slope
    return _Pressed(
        depth=np.maximum(depths / balance.side, 0.0), F=force, rates=rates, fruit_share=1.0 / (1.0 + springs)
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Balance:
    """Depth + others F(depth) = reach: what spring and other tips, `others`, leave of the travel of each tip.

    `reach` (travels, tips) [mm], `stiffness` of the flesh at first touch (moduli, 1, tips) [N/mm], `others` (moduli, 1,
    tips, tips) [mm/N].
    """

    curve: ForceCurve
    side: float
    reach: Floats
    stiffness: Floats
    others: Floats

    def force(self, depths: Floats) -> tuple[Floats, Floats]:
        """Return forces [N] and their slopes over the depth [N/mm] at depths [mm], all (moduli, travels, tips)."""
        share, slope = self.curve.force(depths / self.side)
        return np.asarray(self.side * self.stiffness * share), np.asarray(self.stiffness * slope)

    def tangent(self, slope: Floats) -> Floats:
        """Return the derivative of the balance (moduli, travels, tips, tips) [1]."""
        return np.asarray(np.eye(slope.shape[-1]) + self.others * slope[..., None, :])

    def depths(self) -> Floats:
        """Return the depths [mm]; raises SolveError, and InputError where one is beyond the curve."""
        at_once = np.broadcast_to(self.reach, (len(self.stiffness), *self.reach.shape))
        slope = np.broadcast_to(self.stiffness, at_once.shape)
        depths: Floats = np.linalg.solve(self.tangent(slope), at_once[..., None])[..., 0].astype(np.float64)
        for _ in range(MOST_ITERATIONS):
            force, slope = self.force(depths)
            residual = depths + (self.others @ force[..., None])[..., 0] - self.reach
            if np.abs(residual).max() <= RESIDUAL_LIMIT * np.abs(self.reach).max():
                self.curve.factor(np.maximum(depths / self.side, 0.0))  # refuses what is beyond the curve
                return depths
            depths = np.asarray(depths - np.linalg.solve(self.tangent(slope), residual[..., None])[..., 0])
        msg = "large strain: springs and flesh found no equilibrium; check springs and travel"
        raise SolveError(msg)


def flesh_error(scene: Scene, curve: ForceCurve, depth: Floats) -> Floats:
    """Return the relative error of the flesh's force [1] at depths [tip sides], of the same shape."""
    square = SQUARE_ROUNDED if scene.tips.fillet_mm > 0.0 else SQUARE_SHARP
    tip = round_tip(scene)
    body = FINITE_BODY + OF_ROUNDED * tip.edge / tip.radius
    mapped = CROSSTALK + body + (0.0 if scene.tips.tip_shape.is_round else square)
    return np.asarray(curve.error(depth) / curve.factor(depth) + mapped)
