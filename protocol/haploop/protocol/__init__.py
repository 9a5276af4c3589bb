"""The common ground of all processes: scene, messages, wire format, sockets and simulated time.

``messages`` and ``processes`` are the two tables from which wire format, checks and ``protocol/README.md`` derive.
A node is a ``run_node`` call with a ``ClockClient``; plant and controller talk through ``loop``, everyone else
listens to ``telemetry``, an attached node as an ``Observer``.
"""
