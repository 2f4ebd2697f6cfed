"""Words of the bill of materials that its readers look for, who need no CAD kernel."""

EACH = " each"  # after the mass of a printed part
