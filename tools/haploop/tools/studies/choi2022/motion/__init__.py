"""Prescribed motions: momentum loops, acceleration, spectra."""
