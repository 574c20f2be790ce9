"""A cold start compiles in two processes at once: this module is what the second one runs.

Both write into the same cache folder; the first waits for the second and then loads what that has compiled. If the
second fails, the first compiles all of it by itself.
"""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np

from evolvent import jit
from evolvent.builder import Builder
from evolvent.flow import bind_corrections


def start(method: str) -> subprocess.Popen | None:
    """Start compiling events and projections aside, unless `method` has been compiled into this cache before."""
    if jit.is_warm(method):
        return None
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    try:
        return subprocess.Popen(
            [sys.executable, "-c", f"from {__name__} import main; main()"],
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
    except OSError:
        return None


def main() -> None:
    """Compile the functions of a model that need no right-hand side."""
    bind_corrections(Builder(np.zeros(3)).build().model)
