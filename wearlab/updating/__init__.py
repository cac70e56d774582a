"""Measurements make wear coefficient and remaining life better known."""

from wearlab.updating.errors import UpdateError
from wearlab.updating.updating import update

__all__ = ["UpdateError", "update"]
