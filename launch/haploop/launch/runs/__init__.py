"""Ways to run one scene: as processes (``start``), in this process (``in_process``), again from its log (``replay``).

``loaded_scene`` and ``result`` are the Python front door, re-exported by ``haploop.api``.
"""
