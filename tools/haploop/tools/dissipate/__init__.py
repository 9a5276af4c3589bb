"""What dissipation elements would have taken out of a motion that was recorded: ``haploop dissipate``."""
