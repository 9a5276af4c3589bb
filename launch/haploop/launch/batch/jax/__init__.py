"""Compiled batches: the tick of a batch traced by jax and compiled, on a CPU or a GPU.

``run.compiled_results`` is the way in. Nothing outside this room imports jax.
"""
