"""Diagrams of the pages on scene sections, as SVG: ``python -m docs.diagrams docs/scene/diagrams`` draws all."""
