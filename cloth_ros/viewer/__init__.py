"""Browser view of running cloths, which it knows by topics, services and parameters only."""
