"""What all processes share: scene, changes, simulated time, numbers and trees; ``transport`` connects them."""
