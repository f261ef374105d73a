"""Messages made from arrays, without a Python object for each point."""
