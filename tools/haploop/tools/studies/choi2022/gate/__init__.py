"""The gate of unidirectional inertia (eq. 9) at one frequency: describing functions and timing."""
