"""A study of Choi et al. 2022: its figures made by this program, and a finding for every claim of sections II to VI.

A figure N is a module ``figures/figure_N.py`` and a table ``[N]`` of ``figures.toml`` with its title, its texts and its
claims. It is found by its name and needs no entry anywhere:

    CLAIMS = claims_of(3)

    def make(work: Work) -> list[Finding]:
        ...                                     # run scenes; work.small asks for a version of seconds
        work.figure(figure, "figure_3")         # figure_3.png
        work.data("figure_3", columns)          # figure_3.npz
        work.scene("figure_3", scene)           # figure_3.toml, runs by itself
        return [CLAIMS["generates"].holds_if(leak_J > 0.0, leak=amount(leak_J, "J"))]

Each claim gets one finding: it holds, holds under a stated assumption or does not hold, with numbers that were
computed. The page is written from them, never by hand.

    simulation, simulation_measure: interpretations of section V.A as scenes, and how far each is from the paper
    device, experiment, experiment_measure: those of section V.B, the search among them, which walls are steady
    interpretations, drawing: tables of interpretations, and what a search among them found; colours
    sampled, theory: energy of sampled motion, the gate of eq. 9, limits of the linear loop
    claims, work, command: claims and findings, a figure in the making, ``haploop paper`` and its page
"""
