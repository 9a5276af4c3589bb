"""Compiled batches: the tick of a batch traced by jax and compiled, on a CPU or a GPU.

``runs.in_jax.compiled_results`` is the entry point. Nothing outside this package imports jax.
"""
