"""``haploop export-fmu``: the controller of a scene as a functional mock-up unit (FMI 3.0, co-simulation), in C.

``variables`` says what an importer sees of a scene's controller, ``description`` writes that as XML, ``package``
compiles and packs. ``controller.h`` repeats the controller's tick in C, to the same bits, and ``fmi3.c`` calls it.
"""
