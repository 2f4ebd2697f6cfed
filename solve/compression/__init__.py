"""A whole fruit pressed at finite strain: the force over the travel of a plate or a plunger."""
