"""Notes on scenes that are valid but cannot be meant; ``notes.note_unmeant`` returns them.

A ``rule.Rule`` has a condition and its sentence: the rules of ``reach`` say why a wall is not reached, those of
``loop`` all else.
"""
