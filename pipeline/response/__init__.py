"""Forces and their ratio over modulus and travel, in the scene that was asked for."""
