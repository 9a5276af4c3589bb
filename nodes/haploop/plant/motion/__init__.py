"""The motion of one mass under held forces by the exact transition, and the force of the hand.

``one_mass`` moves it, ``transition`` holds the mathematics.
"""
