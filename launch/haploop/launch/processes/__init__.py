"""The operating system's side of a run.

``supervisor.run_processes`` starts, leads and ends a run; ``children`` are its processes and the signals that end it.
``private_directory`` makes the directory of its sockets, holds its lock and removes it; ``run_directory`` finds live
runs by their directories and sends them commands.
"""
