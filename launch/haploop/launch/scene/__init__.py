"""The scene file: reading, layers and overrides, checking, and every mistake reported at once.

``file.load`` reads and resolves; ``check.resolve`` checks tables that were merged already, and ``SceneError`` (in
``mistakes``) holds all that is wrong. The keys are declared in ``haploop.protocol.scene``; ``models`` makes the
validating models of them, ``schema`` describes them for editors.
"""
