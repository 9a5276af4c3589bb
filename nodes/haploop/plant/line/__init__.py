"""The line from the controller to the device: delay, jitter, loss, and the actuator at its end.

``delay.make_line`` makes the line of a scene.
"""
