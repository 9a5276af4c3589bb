"""The HTTP server on loopback: files, access control, and the connection of every page.

``server`` starts it, ``page`` serves one page.
"""
