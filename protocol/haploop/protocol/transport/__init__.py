"""Transport between processes: messages, wire format, sockets, the loop, telemetry, and what all nodes have in common.

``messages`` holds the tables of processes and messages, ``wire`` their encoding, ``sockets`` what they travel on. A
node is a ``node.run_node`` call with a ``ClockClient``; plant and controller talk through ``loop``, everyone else
listens to ``telemetry``, an attached node as an ``Observer``.
"""
