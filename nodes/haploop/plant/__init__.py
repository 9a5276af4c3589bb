"""The device in the hand: its dynamics, effects, integrators and the plant process."""
