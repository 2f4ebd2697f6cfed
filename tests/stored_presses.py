"""Six presses of a square of domes on ellipsoids: forces that another program of boundary elements found once."""

import json
from pathlib import Path
from typing import Any

STORED: dict[str, Any] = json.loads(Path(__file__).with_name("presses_on_ellipsoids.json").read_text(encoding="utf-8"))
"""`sensor`, `poisson`, `presses` (lengths in mm, forces in N, moduli in MPa, angles in degrees), and their source."""
