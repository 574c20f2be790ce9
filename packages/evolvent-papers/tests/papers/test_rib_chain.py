"""The chain of links, the second model of the winding rib: its forces, order, stability, and the cable beside it."""

import numpy as np
import pytest

from evolvent import cases
from evolvent_papers import papers
from evolvent_papers.papers import rib
from evolvent_papers.papers.rib_chain import Chain
from evolvent_papers.papers.winding import CHAIN, ENERGY, Model, Trial, run_all

CASE = cases.load("wrapped-rib", {"damping.alpha": 0.0})


def energy(chain, x):
    """Energy of links, angles and contacts of a chain."""
    return chain.energy(x, np.zeros_like(x))


def test_forces_are_those_of_an_energy():
    chain = Chain(CASE, 6)
    chain.torque, chain.bending = 0.0, 0.7
    rng = np.random.default_rng(1)
    x = 0.4 * chain.start + rng.uniform(-0.3, 0.3, chain.start.shape)
    assert (np.hypot(*x.T) < chain.R).any()
    found = np.zeros_like(x)
    for k in np.ndindex(x.shape):
        d = np.zeros_like(x)
        d[k] = 1e-6
        found[k] = -(energy(chain, x + d) - energy(chain, x - d)) / 2e-6
    assert chain.force(0.0, x) == pytest.approx(found, rel=1e-6, abs=1e-6 * np.abs(found).max())


def test_the_field_has_the_torque_as_its_resultant():
    chain = Chain(CASE, 6)
    x = chain.start + np.random.default_rng(2).uniform(-0.3, 0.3, chain.start.shape)
    f = chain._field(0.0, x)
    assert (x[:, 0] * f[:, 1] - x[:, 1] * f[:, 0]).sum() == pytest.approx(0.2)


def test_the_order_is_two():
    chain = Chain(CASE, 8)
    step = 2.0**-9
    assert step < chain.limit
    ends = [chain.run(1.5, step / k).tip[-1] for k in (1, 2, 4)]
    order = np.log2(np.linalg.norm(ends[0] - ends[1]) / np.linalg.norm(ends[1] - ends[2]))
    assert order == pytest.approx(2.0, abs=0.15)


def test_drag_takes_speed_in_proportion():
    """The field moves the straight chain's tip as a free mass: v' = T x/(m r^2 summed) - alpha v."""
    alpha = 0.5
    chain = Chain(cases.load("wrapped-rib", {"damping.alpha": alpha}), 8)
    motion = chain.run(1.0, 2.0**-9)
    pushed = 0.2 * 12.6 / float(chain.mass @ chain.start[:, 0] ** 2)
    assert motion.speed[-1] == pytest.approx(pushed * (1.0 - np.exp(-alpha)) / alpha, rel=0.01)


def test_steps_beyond_the_limit_diverge():
    chain = Chain(CASE, 20)
    assert chain.run(10.0, 0.5).diverged
    assert not chain.run(10.0, 0.9 * chain.limit).diverged
    found = rib.ChainModel(10.0, rib.FREE, 20).run(Trial(CHAIN, step=0.5))
    assert found.status == "diverged"
    assert found.outcome.startswith("diverged at ")


def test_the_chain_keeps_the_work_of_the_torque():
    """Through the whip too, by central differences to second order; a contact that dissipates takes some of it."""
    case = cases.load("wrapped-rib", {"damping.alpha": 0.0, "rib.length": 3.0})
    step = 0.45 * Chain(case, 20).limit
    motions = [Chain(case, 20, dissipation).run(4.5, step) for dissipation in (0.0, 0.5)]
    assert max(np.hypot(*one.tip.T).min() for one in motions) < 0.7  # on the hub
    off, taken = ((one.energy - one.work) / one.energy.max() for one in motions)
    assert np.abs(off).max() < 0.05
    assert np.diff(taken).max() < 0.01
    assert taken[-1] < -0.5


@pytest.mark.slow
def test_the_chain_and_the_cable_have_one_path_before_the_whip():
    model, chain = Model("wrapped-rib", 20.0, rib.FREE), rib.ChainModel(20.0, rib.FREE, 80)
    trials = [(model, Trial(ENERGY, step=0.02)), (chain, Trial(CHAIN, share=0.9))]
    implicit, explicit = (run for _, run in run_all(trials, papers.silent))
    assert explicit.error(implicit, 20.0) < 0.02
    assert np.abs(explicit.speed - implicit.speed).max() < 0.06 * implicit.speed.max()
