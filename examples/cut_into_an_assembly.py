"""The housing cut and joined in CadQuery: a cable hole through the frame, a bracket above it, both in one assembly.

The housing is a CadQuery solid like any other. The hole is in the frame, so it does not change the springs.
"""

from pathlib import Path

import cadquery as cq

import twintip

CABLE_MM = 4.0  # diameter of the hole
BRACKET_MM = (60.0, 30.0, 4.0)  # length, width, thickness

result = twintip.evaluate(twintip.load_design("paper"))
housing = twintip.housing(result)
bounds = housing.val().BoundingBox()
frame = result.springs.housing
level = 0.5 * (frame.cavity_level + frame.top_level)  # the middle of the bar above the springs

hole = cq.Workplane("XZ").center(0.0, level).circle(CABLE_MM / 2.0).extrude(2.0 * bounds.ylen, both=True)
drilled = housing.cut(hole)
bracket = cq.Workplane(origin=(0.0, 0.0, bounds.zmax + BRACKET_MM[2] / 2.0)).box(*BRACKET_MM)

assembly = cq.Assembly(name="sensor").add(drilled, name="housing", color=cq.Color("orange"))
assembly.add(bracket, name="bracket", color=cq.Color("gray"))
Path("outputs").mkdir(exist_ok=True)
assembly.export("outputs/sensor-with-bracket.step")

print(f"housing {bounds.xlen:.1f} x {bounds.ylen:.1f} x {bounds.zlen:.1f} mm")
print(f"the hole takes {housing.val().Volume() - drilled.val().Volume():.1f} mm^3 away")
print(f"the housing is {drilled.solids().size()} solid, and the kernel calls it valid: {drilled.val().isValid()}")
overlap = drilled.intersect(bracket).solids().size()
print(f"bodies in the assembly: {len(assembly.children)}, overlaps between them: {overlap}")
