"""Recordings: text files and logs, their samples, units and time stamps.

``text_recording`` reads most of them.
"""
