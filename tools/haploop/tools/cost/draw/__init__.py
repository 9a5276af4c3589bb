"""Figures, screens and the page of what accuracy costs."""
