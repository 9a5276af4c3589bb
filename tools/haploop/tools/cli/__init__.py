"""The command line. ``main`` names every command; the work is imported when it is used."""
