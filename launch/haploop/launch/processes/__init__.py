"""The operating system side of a run: child processes, signals, and the private directory of a live run."""
