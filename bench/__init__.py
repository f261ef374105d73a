"""What the solver costs on this machine, beside the machine's own limit and other engines."""
