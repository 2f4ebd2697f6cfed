"""One rigid flat tip pressed deep into soft flesh: axisymmetric contact at finite strain.

The program that makes sensor/theory/large_strain.toml. It shares the laws of flesh and the principal stretches with
solve/compression; grid, elements, contact and Newton's method are its own. `table_row` of `table.py` makes a row.
"""
