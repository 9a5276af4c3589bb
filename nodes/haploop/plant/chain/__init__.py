"""The motion of several bodies in a row (transmission, grip, actuator lag), by the exact transition."""
