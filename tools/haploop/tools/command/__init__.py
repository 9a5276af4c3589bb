"""Shared parts of the commands of every tool: options, elements of plugin files, notes, and exiting on Ctrl-C."""
