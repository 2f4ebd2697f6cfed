"""Contact against a closed form: flat round tips on blocks of growing size.

A rigid flat punch of radius a on a half-space has the stiffness 2 a E / (1 - nu^2). The larger the block and the
distance of its tips, the nearer the solved contact must be to this value.
"""

import twintip

DIAMETER_MM = 1.0

print("block        solved K_m/E   closed form   difference")
for side in (20.0, 40.0, 80.0):
    changes: dict[str, object] = {
        "tips.shape": "cylinder",
        "tips.socket": "pin",
        "tips.side_mm": DIAMETER_MM,
        "tips.spacing_mm": 0.4 * side,
        "fruit.length_mm": side,
        "fruit.width_mm": side,
        "fruit.height_mm": side,
    }
    design = twintip.load_design("paper", changes)
    contact = twintip.evaluate(design, twintip.RunOptions(look=True, tolerance=0.02)).contact
    solved = contact.K_m_over_E()  # [mm]
    closed_form = DIAMETER_MM / (1.0 - design.fruit.poisson**2)  # 2 a = the diameter
    difference = 100.0 * (solved / closed_form - 1.0)
    print(f"{side:3.0f} mm {solved:16.4f} mm {closed_form:10.4f} mm {difference:+10.1f} %")
