"""Forces on one particle: springs and dashpots, air, gusts."""
