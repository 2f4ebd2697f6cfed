"""The drawing of the housing: views, dimensions, measuring table, frame and title block, as DXF, SVG and PDF."""
