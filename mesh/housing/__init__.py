"""The hexahedral mesh of half the housing: the profile is divided into blocks and swept through half the depth."""
