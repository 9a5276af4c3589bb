"""The figure of a run, and what all figures share.

``run_figure`` draws it.
"""
