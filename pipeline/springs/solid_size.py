"""The size of a housing's solid, for a worker that has the CAD kernel and need not import a solver."""

from cad.parts.housing import Housing, PartSize


def solid_size(housing: Housing) -> PartSize:
    """Return volume, surface and areas of named faces of the solid of a housing [mm]."""
    from cad.parts.housing_solid import housing_part

    return housing_part(housing).size
