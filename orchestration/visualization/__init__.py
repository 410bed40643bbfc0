"""Figures, animations and interactive pages of a result."""
