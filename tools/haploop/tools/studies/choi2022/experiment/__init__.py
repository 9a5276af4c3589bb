"""The experiments of section V.B: interpretations of the device, the search among them, and which walls are steady."""
