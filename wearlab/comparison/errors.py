"""Two things that cannot be compared."""


class CompareError(ValueError):
    """Runs or campaigns that have nothing in common to compare; the message says what each has."""
