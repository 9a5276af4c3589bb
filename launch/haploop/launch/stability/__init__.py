"""Judges a run by what stability means: held still and pushed at its end, does the loop forget the push and rest?

``judge`` and ``judge_batch`` are what others call. ``still_hand`` and ``still_batch`` continue from the end of a run,
``looks`` says when to look, ``traces``, ``turns`` and ``swing`` measure what is seen, ``decide`` finds the verdict,
``finding`` states it together with what it rests on.
"""
