"""Studies that measure the program: cases that are varied, what is measured, and how it is shown.

`description` reads a study's file, `run` measures its points by a function of `measures`, and
`page` shows the records by a function of `figures`.
"""
