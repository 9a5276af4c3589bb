"""The line from the controller to the device: delay, jitter, loss, and the actuator at its end.

``delay.line_of`` makes the line of a scene.
"""
