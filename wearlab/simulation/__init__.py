"""Scenes become labelled datasets: the only place where physics arrays get names."""

from wearlab.life.checkpoint import checkpoints
from wearlab.simulation.dataset.modes import modes_table
from wearlab.simulation.label import Refused
from wearlab.simulation.run import simulate
from wearlab.simulation.warm import warm_up
