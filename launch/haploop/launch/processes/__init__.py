"""The operating system's side of a run.

``supervisor.run_processes`` starts, leads and ends a run; ``children`` are its processes and the signals that end it.
``run_directory`` finds live runs by their private directories and sends them commands.
"""
