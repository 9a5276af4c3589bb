"""The live page: an attached node that shows a running simulation in a browser on this machine.

``receive`` takes telemetry, log and answers of the clock, ``store`` keeps them in bounded memory, ``draw`` makes
snapshots and state messages from them, ``serve`` is the HTTP server; ``viewer`` joins them for one run after another.
"""
