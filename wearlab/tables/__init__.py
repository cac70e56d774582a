"""Tables as people and machines write them: any usual separator, sign, encoding.

One reader serves measured flanks, duties, stiffnesses, weighings and histories. What
was understood is kept, for messages and for ``wearlab profile``; what has two meanings
is refused with the words that decide.
"""

from wearlab.tables.cells import LARGEST_NUMBER as LARGEST_NUMBER
from wearlab.tables.cells import TableError as TableError
from wearlab.tables.reading import LARGEST_FILE as LARGEST_FILE
from wearlab.tables.reading import decoded as decoded
from wearlab.tables.reading import read_table as read_table
from wearlab.tables.reading import table_of as table_of
from wearlab.tables.reading import text_of as text_of
from wearlab.tables.table import ReadTable as ReadTable
from wearlab.tables.table import in_unit as in_unit
