"""Work that needs the CAD kernel, beside a run in a process of its own."""
