"""What stands in :mod:`wearlab.options`, under its former name."""

from wearlab.options import *  # noqa: F403
