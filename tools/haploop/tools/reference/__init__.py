"""What a scene's motion truly is, in as many digits as asked for."""
