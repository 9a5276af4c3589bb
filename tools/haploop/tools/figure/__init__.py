"""The figure of a run, and what all figures share."""
