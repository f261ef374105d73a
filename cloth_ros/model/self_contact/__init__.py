"""Contact of the sheet with itself: no vertex passes a triangle, and no edge an edge."""
