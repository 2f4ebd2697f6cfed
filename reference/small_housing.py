"""A housing with short leaves, whose meshes for other programs are small."""

from cad.parts.housing import Housing
from sensor.theory.leaf_spring import Flexure

SMALL_HOUSING = Housing(
    low=Flexure(thickness=0.8, length=9.0, depth=4.0, separation=8.0, fillet=0.5),
    high=Flexure(thickness=1.2, length=7.0, depth=4.0, separation=8.0, fillet=0.5),
    tip_side=1.0, tip_height=1.0, spacing=6.0, shuttle_width=4.0, neck_level=2.5, lower_leaf_level=4.7,
    low_top_level=15.0, high_top_level=15.2, cavity_level=15.5, top_level=20.0, protrusion=1.0, wall_width=6.0,
)  # fmt: skip
