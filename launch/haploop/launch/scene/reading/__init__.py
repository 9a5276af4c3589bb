"""One TOML file: ``tables`` reads it, or says why it cannot; ``lines`` tells where each key stands."""
