"""Measurements make wear coefficient and remaining life better known."""

from wearlab.updating.inference import update
from wearlab.updating.measurements import UpdateError
