"""Advice on a device: how stiff a wall is safe, with which element, what breaks it first, what change gains most.

``command`` is ``haploop advise``; ``subject`` reads device and scene, ``cases`` says what a wall has to bear, ``loops``
moves many at once, ``felt`` tells a buzz, ``trial`` puts these together. ``limit`` searches one limit, ``search`` the
element; ``changes`` and ``assumptions`` alter the device; ``advice`` holds it all, ``report`` and ``figure`` show it.
"""
