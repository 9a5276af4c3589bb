"""From a scene file to a finished run: scene, plan, clock, processes, runs, batches and stability.

Begin with ``runs.result.run``, which runs a loaded scene in this process, and ``runs.start.run``, which runs one as
processes; ``haploop.api`` is the front door for programs.
"""
