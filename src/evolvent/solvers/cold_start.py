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
from evolvent.flow import bind_corrections, bind_linear_solver
from evolvent.kernels import blocks


def start(method: str) -> subprocess.Popen | None:
    """Start compiling a part of what `method` needs aside, unless `method` has been compiled into this cache before."""
    if jit.is_warm(method):
        return None
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    try:
        return subprocess.Popen(
            [sys.executable, "-c", f"from {__name__} import main; main({method!r})"],
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
    except OSError:
        return None


def main(method: str) -> None:
    """Compile what `method` needs beside its right-hand side or residual and its time loop."""
    model = Builder(np.zeros(3)).build().model
    if method == "generalized-alpha":
        bind_linear_solver(model, blocks.bordered(1, 6, 0))
    else:
        bind_corrections(model)
