"""The log of a run in the formats of other programs: ``haploop export``."""
