"""Snapshots for the page: tables of what to draw, packed into frames of bytes."""
