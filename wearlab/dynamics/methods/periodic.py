"""Newton shooting on the period map: the default."""

from wearlab.dynamics.steady.periodic import Periodic

__all__ = ["Periodic"]
