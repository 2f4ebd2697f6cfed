"""The half of the housing in hexahedra: its profile in blocks, swept through half the depth."""
