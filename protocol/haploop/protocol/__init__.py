"""Common ground of all processes: scene, changes, simulated time, numbers and trees; ``transport`` connects them."""
