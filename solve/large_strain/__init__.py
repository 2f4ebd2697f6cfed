"""One rigid tip pressed deep into soft flesh: axisymmetric contact at finite strain."""
