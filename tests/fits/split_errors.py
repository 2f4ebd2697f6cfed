"""SAFETY, LEAST_STEP and ROUGH_ERROR of the split: errors on its coarsest meshes against its finest one.

`python tests/fits split_errors` (2 minutes). An error is compared with the step to the next coarser mesh, and with
what the finite block changes of the half-space, the part that the mesh solves for.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from fits.block_scenes import MUCH, Scene, block, on_mesh, paired, random_scenes
from fits.comparison import Comparison, covering, fitted

from solve.fruit.box import COARSER
from solve.fruit.split import LEAST_STEP, LEVELS, ROUGH, ROUGH_ERROR, SAFETY
from solve.linear import SolveError

COARSE, FINE, FINEST = LEVELS[0].coarser(), LEVELS[0], LEVELS[2]
ORDER = 4
BLOCKS = {"paper": block(12.0), "incompressible": block(12.0, 0.45), "low": block(2.0, 0.45)}
MORE = {"slender": block(60.0, 0.2), "narrow": block(12.0, 0.3, width=4.0)}


def of_step(scene: Scene) -> float:
    """Return the error of s11 - s12 on the coarsest mesh over its step from the next coarser one [1]."""
    coarse, fine, truth = (paired(on_mesh(scene, grading)) for grading in (COARSE, FINE, FINEST))
    return abs(fine - truth) / abs(fine - coarse)


def of_remainder(scene: Scene) -> float:
    """Return the error of s11 - s12 on the coarsest mesh over the remainder's mean share [1]."""
    fine = on_mesh(scene, FINE)
    shares = _shares(scene)
    return abs(paired(fine) / paired(on_mesh(scene, FINEST)) - 1.0) / float(0.5 * (shares[0] + shares.max()))


def rough(scene: Scene) -> float | None:
    """Return the error of s11 - s12 on the rough mesh over the remainder's largest share [1]; None where refused."""
    try:
        found = paired(on_mesh(scene, ROUGH))
    except SolveError:
        return None
    return abs(found / paired(on_mesh(scene, FINE)) - 1.0) / float(_shares(scene).max())


def _shares(scene: Scene) -> np.ndarray:
    """Return what the finite block changes of s11 - s12 and of s11 [1], shape (2,)."""
    fruit, tips = scene
    large = replace(fruit, length_mm=MUCH, width_mm=MUCH, height_mm=MUCH)
    here, half_space = on_mesh(scene, FINE), on_mesh((large, tips), FINE)
    pairs = ((paired(half_space), paired(here)), (half_space.S[0][0], here.S[0][0]))
    return np.array([abs(far / near - 1.0) for far, near in pairs])


def compared(blocks: Sequence[Scene] = tuple(BLOCKS.values()), count: int = 40, seed: int = 1) -> list[Comparison]:
    """`count` random blocks are solved on the rough mesh."""
    errors = [error for error in map(rough, random_scenes(count, seed)) if error is not None]
    left = 1.0 / (COARSER**-ORDER - 1.0)
    least = [of_remainder(scene) / SAFETY for scene in blocks]
    typical, scatter = 0.5 * (min(least) + max(least)), 0.5 * (max(least) - min(least))
    shown = " ".join(f"{share:.2g}" for share in least)
    return [
        fitted(f"SAFETY, twice the {left:.3f} that order {ORDER} leaves", SAFETY, 2.0 * left, 0.05),
        covering("SAFETY", SAFETY, [of_step(scene) for scene in blocks]),
        fitted(f"LEAST_STEP, typical of errors of {shown} of the remainder", LEAST_STEP, typical, scatter),
        covering(f"ROUGH_ERROR, {len(errors)} of {count} random blocks", ROUGH_ERROR, errors),
    ]


def details() -> list[str]:
    return [
        f"{name}: error over step {of_step(scene):.3g}, over remainder {of_remainder(scene):.3g}"
        for name, scene in (BLOCKS | MORE).items()
    ]
