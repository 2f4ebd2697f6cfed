"""Where the tasks of a study run: processes of this machine, or a cluster."""
