"""Lines over a map that need no run: the exact limit and the analytic bounds."""
