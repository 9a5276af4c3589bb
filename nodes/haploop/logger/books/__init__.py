"""The energy books: plant, wall and every element, sampled and true, and the residual that proves them.

``books.Books`` is the entry point.
"""
