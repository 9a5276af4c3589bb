"""Prices of books, log, effects, processes, delay and control rate: jobs to time, measurements, figure."""
