"""The command line and the tools it gathers."""
