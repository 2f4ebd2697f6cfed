"""The fields of a run in PyVista: the place of the largest stress in the springs, and a picture of it.

`flexure.vtu` contains one half of the housing, because the housing is symmetric. The name of each array has its unit.
"""

from pathlib import Path

import numpy as np
import pyvista as pv

import twintip

OUT = Path("outputs/fields")
PICTURE = Path("outputs/stress-of-the-springs.png")

result = twintip.run(twintip.load_design("paper"), twintip.RunOptions(out=OUT, fields=True))
springs = pv.read(OUT / "flexure.vtu")
stress = springs["von_mises_MPa"]
print(f"{springs.n_points} points, largest von Mises stress {stress.max():.2g} MPa")
for name in ("low", "high"):
    moved = np.linalg.norm(springs["displacement_mm"][springs[f"{name}_tip"] == 1], axis=1)
    print(f"the {name} tip moves by {moved.mean():.3f} mm")

bent = springs.warp_by_vector("displacement_mm", factor=5.0)
bar = {"title": "von Mises stress [MPa], movement x 5\n", "n_labels": 5, "fmt": "%.1f", "position_x": 0.2, "width": 0.6}
plotter = pv.Plotter(off_screen=True, window_size=(1000, 560))
plotter.add_mesh(bent, scalars="von_mises_MPa", clim=(0.0, 4.4), scalar_bar_args=bar)
plotter.view_xz()
plotter.camera.zoom(1.5)
plotter.screenshot(PICTURE)
