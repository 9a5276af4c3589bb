"""Judging a run by what stability means: held still and pushed once, does the loop forget the push and come to rest?

``judge.judge_scene`` is what others call. ``still_hand`` goes on from the end of a run, ``traces`` measures what it
does, ``decide`` finds the word for it.
"""
