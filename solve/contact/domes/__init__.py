"""The contact of spherical domes in closed form: its geometry, the fruit under the domes, and the forces on them."""
