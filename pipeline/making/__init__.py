"""The stages that write files of a design: solids, files for fabrication, and fields. They start the CAD kernel."""
