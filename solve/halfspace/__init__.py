"""The elastic half-space in closed form: potentials, and rigid punches on it."""
