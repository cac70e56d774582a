"""The table of kinds of figures, as ``wearlab schema --figures`` lists it."""

from wearlab.figures.kind import Kind
from wearlab.figures.kinds.cycles import DYNAMIC_FACTOR, EQUIVALENT_LOAD, MAX_WEAR
from wearlab.figures.kinds.distribution import HISTOGRAM, PROBABILITY, QUANTILE_BANDS
from wearlab.figures.kinds.engagement import STE, TVMS
from wearlab.figures.kinds.force import MESH_FORCE
from wearlab.figures.kinds.harmonics import DTE_HARMONICS, STE_HARMONICS, STIFFNESS_HARMONICS
from wearlab.figures.kinds.line import LINE
from wearlab.figures.kinds.modes import NATURAL_MODES
from wearlab.figures.kinds.orbit import PHASE_PLANE
from wearlab.figures.kinds.pair import LOAD_SHARE, PAIR_FORCE
from wearlab.figures.kinds.path import ALONG_PATH, WEAR_PROFILE
from wearlab.figures.kinds.scatter import PARALLEL, SCATTER
from wearlab.figures.kinds.sensitivity import SENSITIVITY
from wearlab.figures.kinds.speed import BIFURCATION, POINCARE, RESPONSE_CURVE, WATERFALL
from wearlab.figures.kinds.updates import UPDATE_KINDS

KINDS: dict[str, Kind] = {
    kind.name: kind
    for kind in (
        *(TVMS, STIFFNESS_HARMONICS, STE, STE_HARMONICS, LOAD_SHARE),
        *(MESH_FORCE, PAIR_FORCE, EQUIVALENT_LOAD, DYNAMIC_FACTOR, DTE_HARMONICS, PHASE_PLANE, NATURAL_MODES),
        *(RESPONSE_CURVE, BIFURCATION, POINCARE, WATERFALL),
        *(WEAR_PROFILE, MAX_WEAR, ALONG_PATH, SENSITIVITY, HISTOGRAM, PROBABILITY, QUANTILE_BANDS, LINE),
        *(SCATTER, PARALLEL),
        *UPDATE_KINDS,
    )
}
