"""wearlab: experiments and datasets of coupled gear wear and dynamics.

The public names are loaded when they are first used, so that a command which needs little starts at once.
No room of the package bears the name of a public function: importing it would hide the function.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from wearlab.version import __version__ as __version__

if TYPE_CHECKING:
    from wearlab.browsing import browse as browse
    from wearlab.campaign import Campaign as Campaign
    from wearlab.campaign import CampaignError as CampaignError
    from wearlab.campaign import load as load
    from wearlab.comparison import compare as compare
    from wearlab.comparison import sobol_indices as sobol_indices
    from wearlab.figures import FigureError as FigureError
    from wearlab.figures import figure as figure
    from wearlab.gradients import GradientError as GradientError
    from wearlab.gradients import gradient as gradient
    from wearlab.query import QueryError as QueryError
    from wearlab.runner import run as run
    from wearlab.runner.plan import plan as plan
    from wearlab.scene import Scene as Scene
    from wearlab.scene import SceneError as SceneError
    from wearlab.simulation import simulate as simulate
    from wearlab.store import Store as Store
    from wearlab.store import StoreError as StoreError
    from wearlab.store import open_store as open  # noqa: F401
    from wearlab.store.align import align as align
    from wearlab.updating import update as update

HOMES = {
    "Campaign": "wearlab.campaign",
    "CampaignError": "wearlab.campaign",
    "FigureError": "wearlab.figures",
    "GradientError": "wearlab.gradients",
    "QueryError": "wearlab.query",
    "Scene": "wearlab.scene",
    "SceneError": "wearlab.scene",
    "Store": "wearlab.store",
    "StoreError": "wearlab.store",
    "align": "wearlab.store.align",
    "browse": "wearlab.browsing",
    "compare": "wearlab.comparison",
    "figure": "wearlab.figures",
    "gradient": "wearlab.gradients",
    "load": "wearlab.campaign",
    "open": "wearlab.store:open_store",
    "plan": "wearlab.runner.plan",
    "run": "wearlab.runner",
    "simulate": "wearlab.simulation",
    "sobol_indices": "wearlab.comparison",
    "update": "wearlab.updating",
}
__all__ = [
    *("Campaign", "CampaignError", "FigureError", "GradientError", "QueryError", "Scene", "SceneError"),
    *("Store", "StoreError"),
    *("align", "browse", "compare", "figure", "gradient", "load", "open", "plan", "run", "simulate"),
    "sobol_indices",
    "update",
]


def __getattr__(name: str) -> object:
    if name in HOMES:
        module, _, own = HOMES[name].partition(":")
        return getattr(import_module(module), own or name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
