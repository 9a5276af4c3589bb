"""The simulation of section V.A: its readings, the search among them, and the nearest one."""
