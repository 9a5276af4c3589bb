"""Comparison of all stabilizers on one loop, each tuned by the same search with the same effort on the same task.

``conditions`` draws what a wall has to bear; ``bench`` tunes one stabilizer and tries it; ``comparison`` does so for
all, on several loops, ``ranking`` says what can be told apart; ``report``, ``figure`` and ``page`` show it;
``command`` is ``haploop compare``.
"""
