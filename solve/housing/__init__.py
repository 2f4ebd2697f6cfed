"""The deformation of the printed housing under forces on its tips."""
