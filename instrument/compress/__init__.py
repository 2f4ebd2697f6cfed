"""Compression tests of fruit: the modulus from forces and travels."""
