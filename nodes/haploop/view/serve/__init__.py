"""The page out: the HTTP server on loopback, its guard, and the connection of every page."""
