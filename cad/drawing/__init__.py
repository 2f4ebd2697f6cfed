"""The drawing of the housing: views, dimensions, measuring table, frame and title block, in DXF, SVG and PDF."""
