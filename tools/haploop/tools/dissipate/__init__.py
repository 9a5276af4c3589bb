"""``haploop dissipate``: the energy that dissipation elements would have taken out of a recorded motion.

``recording`` reads what was recorded, ``swing`` looks for a buzz in it, ``booking`` puts elements to work on it,
``outcome`` holds the numbers, ``report`` and ``figure`` show them.
"""
