"""The thread converges with its nodes: by itself, and to the continuum (shared/models/thread.md)."""

from __future__ import annotations

import importlib.util
import itertools
import pathlib

import numpy as np
import pytest

from helpers import END, fitted_order, heliogyro, run

_spec = importlib.util.spec_from_file_location("continuum", pathlib.Path(__file__).with_name("continuum.py"))
assert _spec is not None
assert _spec.loader is not None
continuum = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(continuum)

NODES = np.array([20, 40, 80, 160])


def test_tip_lag_converges_with_the_nodes() -> None:
    """Successive differences of the tip lag after 7 s for n = 20, 40, 80, 160: 0.31, 0.046, 0.0095 deg.

    An order of 2.5 (2.6 to 2.9 against the continuum in thread.md).
    """
    t = np.arange(0.0, END, 0.1)
    lags = [run(heliogyro(nodes=int(n)), t).lag() for n in NODES]
    differences = np.array([np.max(np.abs(np.diff(pair, axis=0))[:, t > 7.0]) for pair in itertools.pairwise(lags)])
    assert differences == pytest.approx([0.307, 0.046, 0.0095], rel=0.1)
    assert 2.3 < fitted_order(1.0 / NODES[1:], differences) < 2.9


def test_continuum_is_reached() -> None:
    """An ALE continuum of 4 Legendre modes, solved apart by SciPy, from 5 mm, 40 s: lag and rate converge to it.

    The lumped thread is out by half a node of mass, so that from a given length the order is that of its mass, about
    1.5; 0.25 deg at n = 20, 0.02 deg at n = 160 (largest difference after 7 s).
    """
    t = np.linspace(0.0, 40.0, 161)
    lag, rate = continuum.Continuum(modes=4).solve(t, rtol=1e-6)
    runs = [run(heliogyro(nodes=int(n), out=0.005), t) for n in NODES]
    lags = np.array([np.max(np.abs(r.lag() - lag)[t > 7.0]) for r in runs])
    rates = np.array([np.max(np.abs(r.rate() / rate - 1.0)) for r in runs])
    assert lags == pytest.approx([0.25, 0.12, 0.050, 0.021], rel=0.15)
    assert rates[-1] < 2e-4
    assert fitted_order(1.0 / NODES, lags) > 1.15
    assert fitted_order(1.0 / NODES, rates) > 1.3
