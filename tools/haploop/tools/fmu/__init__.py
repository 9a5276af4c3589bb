"""``haploop export-fmu``: the controller of a scene as a functional mock-up unit (FMI 3.0, co-simulation), in C.

``variables`` says what a scene's controller is to an importer, ``description`` writes that as XML, ``package`` compiles
and packs. ``controller.h`` is the controller's tick a second time, to the same bits, and ``fmi3.c`` what calls it.
"""
