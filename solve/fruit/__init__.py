"""The deformation of the fruit under forces on the tips: its compliance."""
