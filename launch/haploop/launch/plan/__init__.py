"""The plan of a resolved scene: bodies, states, stages of a tick, and the one table of effects (``effects``)."""
