r"""Recorded signals from files: CSV and TSV, TDMS, UFF 58, MAT, HDF5, WAV, and the runs of this package.

>>> import pathlib, tempfile
>>> from evolvent_base import signals
>>> with tempfile.TemporaryDirectory() as folder:
...     path = pathlib.Path(folder) / "knock.csv"
...     _ = path.write_text("time (s),left (mm)\n0,1.5\n0.1,\n0.2,-1.5\n")
...     found = signals.read(path)
>>> found.names, found.units
(('time', 'left'), ('s', 'mm'))
"""

from evolvent_base.signals.formats import is_text, read
from evolvent_base.signals.recording import Column, Signals

__all__ = ["Column", "Signals", "is_text", "read"]
