"""``haploop dissipate``: the energy that dissipation elements would have taken out of a recorded motion.

``text_recording`` and ``samples`` read a recording, ``booking`` puts elements to work on it, ``outcome`` holds
the numbers, ``report`` and ``figure`` show them.
"""
