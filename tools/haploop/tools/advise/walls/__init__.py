"""Trials of walls: ``cases`` says what a wall has to bear, ``loops`` runs many at once, ``felt`` detects a buzz,
``trial`` combines these, ``store`` keeps the results, ``limit`` searches for the stiffest wall that bears all cases,
``rendered`` measures what a hand gets of it.
"""
