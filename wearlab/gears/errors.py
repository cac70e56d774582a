"""The refusal of a gear that cannot be made, or cannot run with its mate."""


class GearError(ValueError):
    """A gear or a pair that cannot exist: the reason with its numbers, and a remedy."""
