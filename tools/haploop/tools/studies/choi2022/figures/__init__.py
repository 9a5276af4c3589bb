"""The figures of the study, a module ``figure_N`` each."""
