"""What goes wrong with derivatives."""


class GradientError(ValueError):
    """A derivative that is not there, or not asked for rightly; the message says why and what to do."""
