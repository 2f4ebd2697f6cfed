"""Tips on the fruit: where they touch, with which pressure, and the forces the sensor reads."""
