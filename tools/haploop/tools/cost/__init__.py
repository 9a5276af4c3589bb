"""The time that accuracy costs: errors against references, times, prices of everything else that can be left out.

``command`` is ``haploop cost``; ``grid`` (against ``reference``) and ``times`` run and time every method at every plant
rate, ``prices`` does so for books, log, effects, processes, delay and control rate; ``measure`` makes cost.json
(``data``) from these, which ``findings``, ``figure``, ``prices_figure`` and ``page`` show.
"""
