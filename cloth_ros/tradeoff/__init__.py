"""Speed against accuracy, measured: what each setting costs, and how wrong it is."""
