"""The time that accuracy costs: errors against references, times, prices of everything else that can be left.

``command`` is ``haploop cost``; ``grid``, ``points``, ``times`` and ``measure`` run and time every method at every
plant rate into a ``store``; ``prices`` does the same for books, log, effects, processes, delay and control rate;
``data`` is cost.json, of which ``report``, ``figure``, ``findings`` and ``page`` are made.
"""
