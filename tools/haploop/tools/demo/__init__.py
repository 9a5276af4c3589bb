"""``haploop demo``: a wall that buzzes, why, and the element that steadies it, shown by a run."""
