"""SLENDER, SCREENED and DEPTH: what these rules of the block's mesh leave, from making each four times as strict.

`python tests/fits block_mesh` (1 minute). On a block that each rule is for, the change of s11 - s12 must be within
the error bar; the change for a rule four times as loose is printed beside it.
"""

from collections.abc import Mapping
from unittest.mock import patch

from fits.block_scenes import Scene, block, on_mesh, paired
from fits.comparison import Comparison

from solve.fruit import box
from solve.fruit.split import LEVELS

# Stricter is larger for SCREENED, which says from where on there is no layer, and smaller for the others.
RULES = {
    "SLENDER": (0.25, block(40.0, length=12.0, width=12.0)),
    "SCREENED": (4.0, block(3.0, length=24.0, width=16.0)),
    "DEPTH": (0.25, block(3.0)),
}


def change(name: str, factor: float, scene: Scene) -> float:
    """Return the relative change of s11 - s12 when a rule is multiplied by a factor [1]."""
    before = paired(on_mesh(scene, LEVELS[0]))
    with patch.object(box, name, factor * getattr(box, name)):
        return abs(paired(on_mesh.__wrapped__(scene, LEVELS[0])) / before - 1.0)


def compared(rules: Mapping[str, tuple[float, Scene]] = RULES) -> list[Comparison]:
    rows = []
    for name, (strict, scene) in rules.items():
        seen = change(name, strict, scene)
        bar = on_mesh(scene, LEVELS[0]).error_pair
        rows.append(
            Comparison(name=f"{name}, change against bar", constant=seen, measured=(seen,), least=0.0, largest=bar)
        )
    return rows


def details() -> list[str]:
    return [
        f"{name} four times as loose: {change(name, 1.0 / strict, scene):.2g}"
        for name, (strict, scene) in RULES.items()
    ]
