"""wearlab: experiments and datasets of coupled gear wear and dynamics."""

__version__ = "0.1.0"
