"""A study of Choi et al. 2022: its figures made by this program, and a finding for every claim of sections II to VI.

Each claim gets one finding: it holds, holds under a stated assumption, rarely or not here, with numbers that were
computed. The pages are written from them, never by hand.

    answers: long calculations, whose answers are kept so that a stopped study goes on
    interpretations: what the paper leaves open (``interpretations.toml``), and for how much of it a claim holds
    simulation: section V.A, its scenes and claims
    device, steadiness, experiment: section V.B, its scenes, which walls an element steadies, its claims
    sampled, theory: energy of sampled motion; the gate of eq. 9, and limits of the linear loop
    runs: runs in this process
    figures, command: figures, their words (``words.toml``) and pages; ``haploop paper``
"""
