"""The half of the housing in hexahedra: its profile in blocks, swept over the depth."""
