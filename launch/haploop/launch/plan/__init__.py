"""The plan of a resolved scene: bodies, states, stages of a tick.

``plan.plan`` makes it. ``effects`` is the one table of all that a scene may name, other packages' included; an
``effect.Effect`` says all there is to say of one, with the checks and ideals of ``rules``.
"""
