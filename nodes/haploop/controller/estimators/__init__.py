"""Velocity and acceleration estimators; ``choose`` makes those that a scene names."""
