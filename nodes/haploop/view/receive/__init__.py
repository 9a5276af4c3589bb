"""Sources of the page: telemetry and events of a run, backfill from its log, answers of its clock.

``run_session`` is a live run, ``past_session`` a recorded one.
"""
