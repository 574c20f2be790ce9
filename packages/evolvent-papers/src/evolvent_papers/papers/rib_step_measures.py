"""Numbers of the ledger on Yi, Yuan, Dong & Li (2017), computed again: time integration, contact law, figure 10."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from evolvent import cases
from evolvent_papers.papers.rib import BEFORE_THE_WHIP, END, FREE, USUAL, ChainModel, two_models
from evolvent_papers.papers.rib_chain import Chain
from evolvent_papers.papers.winding import ALPHA, CHAIN, ENERGY, Model, Trial

Values = dict[str, float]
#: Frequencies times the step at which the amplification of the generalized-alpha method is examined.
STEPS = np.logspace(-3.0, 6.0, 181)
#: Time after the first whip of a rib without damping, s.
FIRST_WHIP = 28.8
#: Interval after the first whip of a rib without damping in which it rebounds freely, s.
AFTER_THE_WHIP = (34.0, 40.0)


def _parameters(radius: float) -> tuple[float, float, float]:
    """alpha_m, alpha_f and beta of Chung & Hulbert for a spectral radius at infinite frequency."""
    return (2.0 * radius - 1.0) / (radius + 1.0), radius / (radius + 1.0), 1.0 / (1.0 + radius) ** 2


def _stepped(state: Any, h: float, radius: float, gamma: float) -> tuple[Any, ...]:
    """One step on x'' = -x: x, v, x'' and the auxiliary acceleration; of arrays too."""
    x, v, acc, a = state
    am, af, beta = _parameters(radius)
    # (1 - am) a1 + am a = -(1 - af) x1 + af acc, x1 = x + h v + h2 ((1/2 - beta) a + beta a1)
    start = x + h * v + h * h * (0.5 - beta) * a
    a1 = (af * acc - am * a - (1.0 - af) * start) / ((1.0 - am) + (1.0 - af) * h * h * beta)
    x = start + h * h * beta * a1
    return x, v + h * ((1.0 - gamma) * a + gamma * a1), -x, a1


def _error(radius: float, shift: float, steps: int) -> float:
    """Error of the generalized-alpha method on x'' = -x after half a period; `shift` is added to the right gamma."""
    state: tuple[Any, ...] = (1.0, 0.0, -1.0, -1.0)
    for _ in range(steps):
        state = _stepped(state, math.pi / steps, radius, 2.0 / (1.0 + radius) - 0.5 + shift)
    return math.hypot(state[0] + 1.0, state[1])


def gamma() -> Values:
    """Order of convergence with gamma = 2/(1 + rho) - 1/2 and with the printed + 1/2, rho = 0.3."""

    def order(shift: float) -> float:
        return math.log2(_error(0.3, shift, 500) / _error(0.3, shift, 1000))

    return {"right": order(0.0), "printed": order(1.0)}


def unconditional() -> Values:
    """Largest spectral radius of a step on an oscillator at any step, and energy gained by steps of 0.02 s, %."""
    worst = 0.0
    for radius in (0.0, 0.3, 0.8, 1.0):
        for h in STEPS:
            # v and both accelerations scaled by the step, which leaves the eigenvalues as they are
            scale = np.array([1.0, h, h * h, h * h])
            grown = np.array(_stepped(np.eye(4) / scale[:, None], h, radius, 2.0 / (1.0 + radius) - 0.5))
            worst = max(worst, float(np.abs(np.linalg.eigvals(scale[:, None] * grown)).max()))
    run = Model("wrapped-rib", 80.0).run(Trial(ALPHA, step=0.02))
    return {"radius": worst, "gained": 100.0 * run.gain, "reached": float(run.t[-1])}


def explicit_limit() -> Values:
    """Longest stable steps of explicit methods: rk4 on the paper's mesh (us) and on the cable, the chain's (ms)."""
    full, cable = (
        Model(name, 80.0).settings(Trial("rk4", share=1.0))["step"] for name in ("wrapped-rib-paper", "wrapped-rib")
    )
    chain = Chain(cases.load("wrapped-rib", {"damping.alpha": 0}))
    run = chain.run(40.0, 0.5)
    return {
        "full": 1e6 * full,
        "cable": 1e3 * cable,
        "chain": 1e3 * chain.limit,
        "reached": float(run.t[-1]) if run.diverged else 40.0,
    }


def contact_law() -> Values:
    """Times at which fixed steps of the paper's set-up fail, s, the end of adaptive steps, and the jump at 1 m/s, N."""
    model = Model("wrapped-rib-paper", 30.0)
    found = {f"h{k}": model.run(Trial(ALPHA, step=step)) for k, step in enumerate((0.5, 0.1, 0.02, 0.004))}
    values = {name: float(run.t[-1]) for name, run in found.items()}
    adaptive = model.run(Trial(ALPHA, tolerance=3e-4))
    return values | {
        "failed": float(sum(run.status == "failed" for run in found.values())),
        "adaptive": float(adaptive.t[-1]),
        "jump": float(cases.load("wrapped-rib-paper").contact.damping),
    }


def half_second() -> Values:
    """Steps of 0.5 s by 40 cable elements: where generalized-alpha fails, s, the mean that another method takes, s.

    And the angle by which the tip would turn about the hub in such a step at its largest speed, rad.
    """
    model = Model("wrapped-rib", 80.0)
    trials = (Trial(ALPHA, step=0.5), Trial(ENERGY, step=0.5), Trial(ENERGY, step=0.005))
    alpha, energy, fine = (model.run(trial) for trial in trials)
    turned = 0.5 * float(fine.speed.max()) / 0.6
    return {"failed": float(alpha.t[-1]), "mean": energy.mean_step, "turned": turned}


def two_methods() -> Values:
    """Times of the first whip by the two methods, s, and difference of the tip's speed before it, % of its largest.

    After the whip: the tip's mean speed, m/s, and the energy at the end, J, with contacts that keep the energy and
    with those of the case, which take some; what those and the steps of the cable have taken, and what the chain that
    keeps it gains, J.
    """
    runs = {name: model.run(trial) for name, model, trial in two_models(END)}
    cable, chain, damped = runs["cable"], runs["chain"], runs["damped_cable"]
    before = cable.t < BEFORE_THE_WHIP
    off = math.sqrt(float(np.mean((chain.speed - cable.speed)[before] ** 2)))
    values = {"off": 100.0 * off / float(cable.speed[before].max())}
    for name, run in (("ancf", cable), ("chain", chain)):
        values[name] = float(run.t[np.argmax(run.speed[run.t < FIRST_WHIP])])
    for name, run in runs.items():
        values[f"{name}_speed"] = run.mean_speed(*AFTER_THE_WHIP)
        values[f"{name}_energy"] = float(run.energy[-1])
    return values | {
        "largest": float(cable.energy.max()),
        "by_contact": float(damped.by_contact[-1]),
        "by_steps": float(damped.work[-1] - damped.by_contact[-1] - damped.energy[-1]),
        "gained": float(chain.energy[-1] - chain.work[-1]),
    }


def cpu_times() -> Values:
    """CPU times of explicit methods up to the whip without damping over those of implicit steps.

    `full` on the paper's mesh, `cable` on 40 cable elements, by rk4; `chain` of the chain in NumPy, and `scaled` if a
    link took the time of an element of the cable.
    """
    end = BEFORE_THE_WHIP
    cable, paper = Model("wrapped-rib", end, FREE), Model("wrapped-rib-paper", end, FREE)
    other = ChainModel(end, FREE)
    implicit, explicit, coarse, full, chain = (
        min((model.run(trial) for _ in range(2)), key=lambda run: run.cpu)
        for model, trial in (
            (cable, Trial(ENERGY, step=0.05)),
            (cable, Trial("rk4", share=0.5)),
            (paper, Trial(ENERGY, step=0.1)),
            (paper, Trial("rk4", share=1.0, stop=2e-3)),
            (other, Trial(CHAIN, share=USUAL)),
        )
    )
    element = explicit.cpu * explicit.mean_step / (4.0 * 40.0)  # of one evaluation, times the end
    return {
        "full": full.cpu / coarse.cpu,
        "cable": explicit.cpu / implicit.cpu,
        "chain": chain.cpu / implicit.cpu,
        "scaled": element * (other.chain.mass.size - 1) / chain.mean_step / implicit.cpu,
    }
