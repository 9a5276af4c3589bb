"""The scene file: reading, layers and overrides, checking, and every mistake told at once.

``file.load`` reads and resolves; ``tables`` declares the keys; ``schema`` describes them for editors.
"""
