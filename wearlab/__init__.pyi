"""The public names and where they are; ``__init__.py`` reads this."""

from wearlab.browsing.window import browse as browse
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
from wearlab.rexs import RexsError as RexsError
from wearlab.rexs import read_rexs as read_rexs
from wearlab.runner import run as run
from wearlab.runner.plan import plan as plan
from wearlab.scene import Scene as Scene
from wearlab.scene import SceneError as SceneError
from wearlab.simulation import simulate as simulate
from wearlab.store import Store as Store
from wearlab.store import StoreError as StoreError
from wearlab.store import open as open
from wearlab.store.align import align as align
from wearlab.updating import update as update
from wearlab.version import __version__ as __version__
