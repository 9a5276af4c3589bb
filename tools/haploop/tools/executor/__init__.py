"""Many scenes on many cores, in bounded memory and without a lost scene."""
