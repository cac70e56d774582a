"""Small scenes, shared with the validation."""

from steady_scenes import loaded, planetary, problem, separating, wears

__all__ = ["loaded", "planetary", "problem", "separating", "wears"]
