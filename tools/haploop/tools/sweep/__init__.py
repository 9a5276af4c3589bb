"""Many scenes at once: ``haploop sweep``, its table, its boundaries and its maps."""
