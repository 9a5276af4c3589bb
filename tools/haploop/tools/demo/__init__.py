"""``haploop demo``: a wall that buzzes, why, and the element that steadies it, told from a run."""
