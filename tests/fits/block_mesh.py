"""SLENDER, SCREENED and DEPTH: what these rules of the block's mesh leave, from making each four times as strict.

`python tests/fits/block_mesh.py` (1 minute). On a block that each rule is for, the change of s11 - s12 must be within
the error bar; the script prints the change for a rule four times as loose beside it.
"""

import sys
from collections.abc import Mapping
from pathlib import Path
from unittest.mock import patch

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from fits.block_scenes import Scene, block, on_mesh, paired  # noqa: E402
from fits.comparison import Comparison  # noqa: E402

from solve.fruit import box  # noqa: E402
from solve.fruit.split import LEVELS  # noqa: E402

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


def _within_bar(name: str, seen: float, bar: float) -> Comparison:
    return Comparison(name=f"{name}, change against bar", constant=seen, measured=(seen,), least=0.0, largest=bar)


def compared(rules: Mapping[str, tuple[float, Scene]] = RULES) -> list[Comparison]:
    return [
        _within_bar(name, change(name, strict, scene), on_mesh(scene, LEVELS[0]).error_pair)
        for name, (strict, scene) in rules.items()
    ]


if __name__ == "__main__":
    for name, (strict, scene) in RULES.items():
        print(f"{name} four times as loose: {change(name, 1.0 / strict, scene):.2g}")
    print(*compared(), sep="\n")
