"""The prices of books, log, effects, processes, delay and control rate."""
