"""The live node: it carries data from topics to the model and back, and computes nothing."""
