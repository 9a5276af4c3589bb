"""Advice on a device: the stiffest wall it renders safely, the element to use, and the cause of buzzing beyond.

``command`` is ``haploop advise``; ``subject`` reads device and scene, ``tasks`` makes the runs that ``judge`` calls
steady or not; ``largest`` searches the stiffness, ``gains`` the parameters, ``margins`` what the ``variations`` leave;
``buzz`` switches off causes; ``advice`` holds it all together; ``report`` and ``figure`` show it.
"""
