"""The clock that leads a run: grants, changes at their ticks, and the commands from other terminals.

``clock.Clock`` decides, ``server.ClockServer`` speaks ZeroMQ, ``roster`` knows the nodes, ``commands`` answers.
"""
