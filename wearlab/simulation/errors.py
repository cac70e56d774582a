"""What a simulation may say instead of a dataset."""


class Refused(ValueError):
    """A scene that cannot be: its gears cannot exist, or cannot run as told."""
