"""Study of a scene: cost and error of solver settings, and validation of the model."""
