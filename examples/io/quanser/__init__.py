"""A simulated data acquisition card with the calls of Quanser's Python package: for trying docs/io-from-python.md
without a card. With this folder's parent on the path it hides an installed `quanser`.
"""
