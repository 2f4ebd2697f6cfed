"""Compression tests of fruit: force over travel to modulus."""
