"""Two hinged panels deploy from a free hub: Basilisk's hinged bodies and evolvent's, in one run of Basilisk.

Run with the package `bsk` installed: ``python benchmarks/basilisk_panels.py``. Both are called at the steps of a task.
Basilisk integrates its hinged bodies by RK4 with that step, evolvent by generalized-alpha with adaptive steps up to it.
Differences are from Basilisk with steps of 5 ms.
"""

from __future__ import annotations

import time

import numpy as np
from Basilisk.simulation import hingedRigidBodyStateEffector, spacecraft
from Basilisk.utilities import SimulationBaseClass, macros

from evolvent import Stepper, System, parts
from evolvent_cosim.basilisk import SpacecraftModule

UNTIL, HUB, PANEL = 40.0, (300.0, (60.0, 50.0, 70.0)), (8.0, (0.1, 0.9, 1.0))
#: Distance from the hub's centre to a hinge, and from there to the panel's centre, m.
OUT, HALF = 0.55, 0.6
ANGLES, STIFFNESS, DAMPING = np.radians([90.0, -60.0]), 0.4, 0.3


def system() -> System:
    """The hub and its panels by evolvent."""
    found = System()
    (mass, inertia), (panel_mass, panel_inertia) = HUB, PANEL
    found.add(parts.RigidBody(mass=mass, inertia=inertia), "hub")
    for k, (side, angle) in enumerate(zip((1.0, -1.0), ANGLES, strict=True), start=1):
        hinge, along = np.array([side * OUT, 0.0, 0.0]), np.array([np.cos(angle), np.sin(angle), 0.0])
        turn = (np.cos(0.5 * angle), 0.0, 0.0, np.sin(0.5 * angle))
        body = parts.RigidBody(
            mass=panel_mass, inertia=panel_inertia, position=hinge + side * HALF * along, orientation=turn
        )
        inner = (-side * HALF, 0.0, 0.0)
        found.add(body, f"panel {k}")
        found.add(parts.Joint(a=("hub", hinge), b=(f"panel {k}", inner), type="revolute", axis=(0, 0, 1)), f"pivot {k}")
        spring = {"start": angle, "rest": 0.0, "stiffness": STIFFNESS, "damping": DAMPING}
        found.add(parts.JointSpring(a="hub", b=f"panel {k}", axis=(0, 0, 1), **spring), f"hinge {k}")
    return found


def craft() -> tuple[spacecraft.Spacecraft, list[hingedRigidBodyStateEffector.HingedRigidBodyStateEffector]]:
    """The same by Basilisk."""
    (mass, inertia), (panel_mass, panel_inertia) = HUB, PANEL
    found, panels = spacecraft.Spacecraft(), []
    found.hub.mHub, found.hub.IHubPntBc_B = mass, np.diag(inertia).tolist()
    for k, (side, angle) in enumerate(zip((1.0, -1.0), ANGLES, strict=True), start=1):
        panel = hingedRigidBodyStateEffector.HingedRigidBodyStateEffector()
        panel.ModelTag = f"panel {k}"
        along, across, about = panel_inertia  # of the axes of a panel here; Basilisk's second axis is that of the hinge
        panel.mass, panel.IPntS_S, panel.d = panel_mass, np.diag([along, about, across]).tolist(), HALF
        panel.k, panel.c, panel.thetaInit = STIFFNESS, DAMPING, angle
        panel.r_HB_B = [[side * OUT], [0.0], [0.0]]
        panel.dcm_HB = [[-side, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, side, 0.0]]  # -h1 along the panel, h2 the axis
        found.addStateEffector(panel)
        panels.append(panel)
    return found, panels


def theirs(step: float) -> tuple[np.ndarray, float]:
    """Basilisk's rate of the hub about z (rad/s) and the angles (rad), at every step, and seconds."""
    scenario = _scenario(step)
    own, panels = craft()
    for k, model in enumerate([own, *panels]):
        scenario.AddModelToTask("own", model, 10 - k)
    logs = [panel.hingedRigidBodyOutMsg.recorder() for panel in panels]
    rate = own.scStateOutMsg.recorder()
    for log in (rate, *logs):
        scenario.AddModelToTask("own", log)
    seconds = _executed(scenario)
    return np.stack([rate.omega_BN_B[:, 2], *(log.theta for log in logs)], axis=1), seconds


def ours(every: float, **settings: float) -> tuple[np.ndarray, float]:
    """The same by evolvent as a module of Basilisk; the seconds are those without results of parts."""
    names, found = ["hub.rate.z", "hinge 1.angle", "hinge 2.angle"], []
    for asked in (names, []):
        scenario = _scenario(every)
        own = SpacecraftModule(Stepper(system(), inputs="hub", until=UNTIL + 1.0, **settings), results=asked)
        scenario.AddModelToTask("own", own)
        found.append((own, _executed(scenario)))
    return np.stack([found[0][0].results[name] for name in names], axis=1), found[1][1]


def _scenario(step: float) -> SimulationBaseClass.SimBaseClass:
    scenario = SimulationBaseClass.SimBaseClass()
    process = scenario.CreateNewProcess("all")
    process.addTask(scenario.CreateNewTask("own", macros.sec2nano(step)))
    return scenario


def _executed(scenario: SimulationBaseClass.SimBaseClass) -> float:
    scenario.InitializeSimulation()
    scenario.ConfigureStopTime(macros.sec2nano(UNTIL))
    began = time.perf_counter()
    scenario.ExecuteSimulation()
    return time.perf_counter() - began


def reference(step: float) -> np.ndarray:
    """The same by evolvent alone, by energy-momentum to 1e-10."""
    found = system().simulate(until=UNTIL, every=step, method="energy-momentum", tolerance=1e-10, fine=False)
    return np.stack([found["hub"].rate[:, 2], found["hinge 1"].angle, found["hinge 2"].angle], axis=1)


if __name__ == "__main__":
    print("called every  by                rate (rad/s)  angles (rad)  seconds")
    for step in (0.1, 0.02):
        finest = theirs(0.005)[0][:: round(step / 0.005)]
        rows = {
            "Basilisk": theirs(step), "evolvent, 1e-6": ours(step, tolerance=1e-6),
            "evolvent, 1e-8": ours(step, tolerance=1e-8), "evolvent alone": (reference(step), np.nan),
        }  # fmt: skip
        for name, (found, seconds) in rows.items():
            off = np.abs(found - finest).max(axis=0)
            print(f"{step:<13g} {name:<17} {off[0]:<13.1e} {off[1:].max():<13.1e} {seconds:.2f}")
