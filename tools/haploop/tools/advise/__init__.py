"""Advice on a device: how stiff a wall is safe, with which element, what breaks it first, what change gains most.

``command`` is ``haploop advise``; ``subject`` reads device and scene; ``walls`` tries walls and finds the limit of one
loop; ``search`` finds the element among ``families``, with ``others`` besides the simple ones; ``withstand`` attacks
it; ``changes`` alters the device; ``advice`` holds it all, with ``known`` values; ``report`` and ``figure`` show it.
"""
