"""The documentation site: ``make docs``, or ``python -m docs.site``, writes it to ``docs/_build/html``.

``pages`` puts the hand-written pages in their places, ``reference`` makes the pages of the public names, of the verbs
and of the methods, and Sphinx turns both into HTML.
"""
