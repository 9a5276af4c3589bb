"""The plan of a resolved scene: bodies, states, stages of a tick.

``plan.plan`` makes it. ``effects`` is the single table of all that a scene may name, including that of other packages;
an ``effect.Effect`` describes one of them completely, with the checks and ideals of ``rules``.
"""
