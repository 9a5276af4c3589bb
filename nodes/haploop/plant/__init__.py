"""The device in the hand: its dynamics, effects, integrators and the plant process.

``plant.Plant`` moves the device from tick to tick.
"""
