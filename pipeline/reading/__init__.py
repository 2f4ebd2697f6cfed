"""What the sensor reads: from tip forces to a modulus, and how good that is over the poses that occur."""
