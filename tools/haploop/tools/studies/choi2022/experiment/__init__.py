"""The experiments of Choi et al. 2022, section V.B: the device as a model, and which walls each element steadies."""
