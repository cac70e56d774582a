"""REXS, the exchange format of gear units: stages become campaign files and back."""

from wearlab.rexs.document import RexsError as RexsError
from wearlab.rexs.stages import read_rexs as read_rexs
