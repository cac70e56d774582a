"""Two runs, or two campaigns, side by side.

What was asked differently, and what came out differently.
"""

from wearlab.comparison.campaigns import compare
from wearlab.comparison.quantities import CompareError
from wearlab.comparison.sobol import sobol_indices
