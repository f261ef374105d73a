"""Grippers: they hold particles of the sheet, which follow their pose rigidly."""
