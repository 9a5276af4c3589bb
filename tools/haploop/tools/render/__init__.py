"""Text for people: numbers with units, tables on the terminal and in Markdown, progress, and fixed sentences.

``terminal`` makes the tables, ``report`` that of a run.
"""
