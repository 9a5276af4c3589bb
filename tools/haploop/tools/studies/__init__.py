"""Studies made with haploop; nothing imports them."""
