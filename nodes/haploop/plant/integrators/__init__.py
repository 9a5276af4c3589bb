"""Ways to integrate the motion of a chain of bodies numerically, to be compared with its exact flow.

The methods of a fixed step are written as in the textbook, for the linear rates z' = A z + p, p the push of all inputs:
force and friction held over the step, load linear in it. A state z and a push p are lists of rows; a row is a number,
or an array of as many numbers as there are motions. ``dop853`` chooses its steps itself.
"""
