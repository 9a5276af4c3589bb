"""Shared parts of the commands of every tool: options, the code of plugins, notes, and leaving on Ctrl-C."""
