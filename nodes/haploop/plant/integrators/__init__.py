"""Numerical integrators of a chain of bodies, to be compared with its exact transition; ``registry`` lists them.

The one-step methods are written as in the textbook, for the linear rates z' = A z + p with the push p of all inputs:
force and friction held over the step, load linear in it. A state z and a push p are lists of rows; a row is a number,
or an array with one number for each motion. ``dop853`` chooses its steps itself.
"""
