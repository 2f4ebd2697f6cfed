"""Meshing of parts. This is the only package that imports gmsh."""
