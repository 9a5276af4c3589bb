"""Nodes that join a running loop."""
