"""Random streams: a function of the seed and a name alone."""
