"""The experiments of two of the three source papers again, on the papers' rigs and with their controllers.

>>> from furuta import papers
>>> run = papers.shahzad2022("step", "linear")
>>> run["x"].shape
(10001, 4)
"""

from furuta._furuta import ramos_velasco, ramos_velasco_draws, shahzad2022

__all__ = ["ramos_velasco", "ramos_velasco_draws", "shahzad2022"]
