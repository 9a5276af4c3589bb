"""What linear theory says of a loop in contact."""
