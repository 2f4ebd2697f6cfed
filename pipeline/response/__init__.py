"""Forces and their ratio over modulus and travel, in the scene of a design."""
