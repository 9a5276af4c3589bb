"""Recordings: text files and logs, their samples, units and time stamps."""
