"""What is made of a design: solids, files for fabrication, fields; the stages that start the CAD kernel."""
