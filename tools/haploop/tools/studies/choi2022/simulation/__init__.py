"""The simulation of section V.A: interpretations of it, the search among them, and what the runs of Fig. 6 show."""
