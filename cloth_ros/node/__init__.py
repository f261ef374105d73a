"""The live node: connects topics, services, parameters and timers to a `LiveCloth`."""
