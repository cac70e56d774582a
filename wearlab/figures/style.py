"""The look of every figure: type, lines and sizes for print."""

from typing import Any

DPI = 180
INK = "#222222"
RC: dict[str, Any] = {
    "font.family": ["STIXGeneral", "DejaVu Serif"],
    "mathtext.fontset": "stix",
    "font.size": 9.0,
    "axes.labelsize": 9.0,
    "axes.titlesize": 9.0,
    "axes.titlelocation": "left",
    "axes.titlepad": 5.0,
    "axes.linewidth": 0.6,
    "axes.edgecolor": "#444444",
    "axes.labelcolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.unicode_minus": True,
    "axes.xmargin": 0.0,
    "axes.ymargin": 0.06,
    "axes.formatter.useoffset": False,
    "grid.color": "#e6e6e6",
    "grid.linewidth": 0.5,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "xtick.color": "#444444",
    "ytick.color": "#444444",
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.direction": "out",
    "ytick.direction": "out",
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "lines.linewidth": 1.15,
    "lines.markersize": 3.6,
    "lines.solid_capstyle": "round",
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "legend.handlelength": 1.9,
    "legend.columnspacing": 1.6,
    "legend.handletextpad": 0.5,
    "legend.borderaxespad": 0.0,
    "legend.borderpad": 0.0,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "savefig.bbox": None,
    "text.color": INK,
}

# inches
MARGIN = 0.08
TITLE_HEIGHT = 0.25
LEGEND_LINE = 0.175
NOTE_LINE = 0.15
NAME_LINE, NAMES = 0.15, 0.7  # of names of ranks: a line, and what else the panel needs
NAME_SHARE, NAME_SIZE = 9.7, 7.5  # letters of a name by inch of the figure's width
LETTERS = 14.0  # of plain text by inch
GAP = 0.07
BAR_WIDTH, BAR_LINE = 2.4, 0.34  # of a bar of colours, and of what it takes with its numbers
BAR_HEIGHT = 0.09
WIDTHS = {1: 5.0, 2: 7.2, 3: 7.2}
HEIGHTS = {"wide": {1: 2.75, 2: 2.25, 3: 1.85}, "square": {1: 4.2, 2: 3.0, 3: 2.2}}
SQUARE_WIDTH = 4.6
SMALL_WIDTH = 3.6
NOTE_SIZE = 7.5
MARK_SIZE = 8.0
