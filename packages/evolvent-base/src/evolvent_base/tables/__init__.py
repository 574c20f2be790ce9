r"""Tables in text files, whoever wrote them: separators, decimal signs, heads, units and times are found in the text.

This is the one reader of such files in the package. It takes the columns apart with the module `csv` and looks at a
column's cells when the column is asked for. Libraries were compared: `clevercsv` and the sniffers of pandas, polars and
DuckDB find the separator alone, and `frictionless` checks against a schema; none tells a decimal comma from thousands,
units or heads below preambles, or reads clock times. Each takes 0.2 to 0.3 s to start.

>>> from evolvent_base import tables
>>> table = tables.read("Zeit / ms;Kraft in N\n0;1.024,5\n50;-998,0\n".encode(), "rig.csv")
>>> table.names, table.units, table.numbers("Kraft")
(('Zeit', 'Kraft'), ('ms', 'N'), array([1024.5, -998. ]))
"""

from evolvent_base.tables.heads import distinct as distinct
from evolvent_base.tables.layout import is_text as is_text
from evolvent_base.tables.marks import mark_of_missing as mark_of_missing
from evolvent_base.tables.reader import read as read
from evolvent_base.tables.table import TextTable as TextTable
from evolvent_base.tables.times import NO_UNIT as NO_UNIT, Times as Times, seconds as seconds, time_of as time_of
from evolvent_base.tables.words import (
    DATE_NAMES as DATE_NAMES,
    TIME_NAMES as TIME_NAMES,
    find_date as find_date,
    find_time as find_time,
    time_columns as time_columns,
)

#: Endings of the names of such files.
ENDINGS = (".csv", ".tsv", ".txt")
