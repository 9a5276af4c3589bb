"""Telemetry in: the session of a run as a viewer receives it, and the backfill from its log."""
