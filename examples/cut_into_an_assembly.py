"""The sensor in CadQuery: a cable hole cut through its parts, and a robot's arm put on its bracket by named faces.

The hole is in the frame, so it does not change the springs. CQ-editor and OCP CAD Viewer for VS Code show the assembly;
other Python only writes it.
"""

from pathlib import Path

import cadquery as cq

import twintip

CABLE_MM = 4.0  # diameter of the hole
ARM_MM = (63.0, 20.0)  # diameter and length of the piece of the arm

result = twintip.evaluate(twintip.load_design("paper"))
assembly = twintip.assembly(result)
assembly.add(twintip.mount(result), name="mount", color=cq.Color("gray"))
frame = result.springs.housing
whole = assembly.objects["housing"].obj

level = 0.5 * (frame.cavity_level + frame.top_level)  # the middle of the bar above the springs
hole = cq.Workplane("XZ").center(0.0, level).circle(CABLE_MM / 2.0).extrude(50.0, both=True)
for name in ("housing", "front_cover", "back_cover", "mount"):
    part = assembly.objects[name]
    part.obj = part.obj.cut(hole.val().moved(part.loc.inverse))  # in the frame of the part

flange = assembly.objects["mount"].obj.faces(tag="flange").val().Center().z
arm = cq.Workplane(origin=(0.0, 0.0, flange)).circle(ARM_MM[0] / 2.0).extrude(ARM_MM[1])  # about the axis of the press
assembly.add(arm, name="arm", color=cq.Color("orange"))
overlap = arm.intersect(assembly.objects["mount"].obj).solids().size()

Path("outputs").mkdir(exist_ok=True)
assembly.export("outputs/sensor-on-an-arm.step")
show_object = globals().get("show_object")  # CQ-editor gives it to a script
if show_object is None:
    try:
        from ocp_vscode import show_object
    except ImportError:
        show_object = None
if show_object is not None:
    show_object(assembly, name="sensor")

drilled = assembly.objects["housing"].obj
bounds = drilled.val().BoundingBox()
print(f"{len(assembly.children)} parts, among them {', '.join(part.name for part in assembly.children[:3])}")
print(f"named faces of the housing: {', '.join(whole.ctx.tags)}")
print(f"housing {bounds.xlen:.1f} x {bounds.ylen:.1f} x {bounds.zlen:.1f} mm")
print(f"the hole takes {whole.val().Volume() - drilled.val().Volume():.1f} mm^3 of it away")
print(f"the housing is {drilled.solids().size()} solid, and the kernel calls it valid: {drilled.val().isValid()}")
print(f"the arm begins {flange - frame.top_level:.1f} mm above the frame, overlaps with the bracket: {overlap}")
