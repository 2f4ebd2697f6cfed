"""Files made from a design: solids, files for fabrication, and fields; these stages start the CAD kernel."""
