"""Small scenes, shared with the tests of accuracy."""

from steady_scenes import loaded, parting, planetary, problem, wears

__all__ = ["loaded", "parting", "planetary", "problem", "wears"]
