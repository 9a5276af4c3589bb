"""The window at the end of a run, what is measured in it, and the verdict that follows.

``window`` gathers it, ``measures`` finds numbers and word.
"""
