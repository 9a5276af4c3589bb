"""The clock that leads a run: grants, changes at their ticks, and the commands of other terminals.

``clock.Clock`` decides, ``server`` speaks ZeroMQ, ``roster`` knows who takes part, ``commands`` answers.
"""
