"""The compliance of the fruit: its deformation under forces on the tips."""
