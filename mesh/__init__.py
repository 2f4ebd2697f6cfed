"""HOW it is divided: the only importer of gmsh."""
