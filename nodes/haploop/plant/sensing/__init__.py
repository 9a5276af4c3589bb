"""What the controller gets to know of the plant: encoder, noise, accelerometer."""
