"""A study of Choi et al. 2022: its figures, made with this program, and a finding for every claim of sections II to VI.

Each claim gets one finding, with computed numbers: it holds, holds under a stated assumption, holds rarely, or does
not hold here. The pages are written from the findings, never by hand.

    answers: long calculations, whose answers are kept so that a stopped study can continue
    interpretations: what the paper leaves open (``interpretations.toml``), and for how much of it a claim holds
    simulation: section V.A: its scenes and claims
    device, steadiness, experiment: section V.B: its scenes, the walls that an element steadies, its claims
    sampled, theory: energy of sampled motion; the gate of eq. 9 and limits of the linear loop
    runs: runs in this process
    figures, command: figures, their texts (``words.toml``) and pages; ``haploop paper``
"""
