"""Walls that are tried: ``cases`` says what one has to bear, ``loops`` moves many at once, ``felt`` tells a buzz,
``trial`` puts these together, ``store`` remembers, ``limit`` searches the stiffest that bears all,
``rendered`` measures what a hand gets of it.
"""
