"""The command line. ``app`` lists every command; the work of a command is imported when it is called."""
