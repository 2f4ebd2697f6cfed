"""Scenes as input decks of CalculiX, another solver, on the meshes and with the elements of this one."""
