"""The motion of several bodies in a row (transmission, grip, actuator lag), by the exact transition.

``motion`` carries the bodies from one change of force to the next.
"""
