"""The map of a sweep: its data, its lines and its drawing."""
