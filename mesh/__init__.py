"""The division of parts into elements: the only package that imports gmsh."""
