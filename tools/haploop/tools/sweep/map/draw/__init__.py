"""Drawing a map of a sweep."""
