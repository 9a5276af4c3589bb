"""Notes on scenes that are in order but cannot be meant; ``notes.note_unmeant`` is the way in.

A ``rule.Rule`` has its condition and the sentence it says: ``reach`` says why a wall is not reached, ``loop`` all else.
"""
