"""Scenes become labelled datasets: the only place where physics arrays get names."""

from wearlab.simulate.errors import Refused
from wearlab.simulate.modes import modes_table
from wearlab.simulate.run import simulate
from wearlab.simulate.warm import warm_up

__all__ = ["Refused", "modes_table", "simulate", "warm_up"]
