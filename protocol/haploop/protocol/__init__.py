"""The common ground of all processes: scene, changes, simulated time, numbers and trees; ``transport`` joins them."""
