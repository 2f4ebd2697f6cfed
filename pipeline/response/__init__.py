"""The forces on the tips and their ratio as functions of modulus and travel, in the scene of a design."""
