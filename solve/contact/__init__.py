"""Contact between the tips and the fruit: its pressure, and the forces that the sensor reads."""
