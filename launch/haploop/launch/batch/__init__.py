"""Many scenes at once: members of one structure as arrays, all others one by one, with the bits of a single run.

``runs.in_batch.batch_results`` is the entry point; ``loops`` sums the books by machine code if numba is installed
(extra ``haploop[numba]``), ``jax`` holds the compiled form (extra ``haploop[jax]``).
"""
