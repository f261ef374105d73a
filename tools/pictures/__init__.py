"""Pictures of the README: moments of scenes, captured from a running node and rendered."""
