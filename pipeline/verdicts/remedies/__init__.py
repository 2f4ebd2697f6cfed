"""What would make a design pass that fails: changes of its keys, tried before anything is meshed."""
