"""The sensors of the plant: encoder, noise, accelerometer."""
