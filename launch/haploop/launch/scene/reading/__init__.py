"""One TOML file: ``tables`` reads it, or says why it cannot; ``lines`` finds where each key stands."""
