"""Running a sweep: cells, boundaries, store and table."""
