"""What was measured: compression tests, units and their readings."""
