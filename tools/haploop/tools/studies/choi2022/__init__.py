"""The figures of Choi et al. 2022 made by this program, and a table of every claim of its sections II to V.

A figure is a module ``figure_N.py`` here. It is found by its name and needs no entry anywhere:

    TITLE = "What the figure shows"
    LEAK = Claim("II, Fig. 3", "the output energy [is] greater than the input energy")
    CLAIMS = (LEAK,)

    def make(work: Work) -> list[Finding]:
        ...                                     # run scenes; work.small asks for a version of seconds
        work.figure(figure, "figure_3")         # figure_3.png
        work.data("figure_3", columns)          # figure_3.npz
        work.scene("figure_3", scene)           # figure_3.toml, runs by itself
        work.caption = "What is seen, in a sentence or two."
        return [LEAK.holds("2.1 uJ a contact")]

Each claim gets one finding: ``holds``, ``assuming`` (under a stated assumption) or ``fails``, with numbers that were
computed. The page (``page.py``) is written from what ``make`` returned, never by hand.
"""
