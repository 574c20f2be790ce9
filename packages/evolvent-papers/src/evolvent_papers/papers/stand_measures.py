"""What the claims of Belyakov (2002) are measured by; each function returns numbers by name."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import Any

import numpy as np
import scipy

from evolvent_massprops import batch, inertia, planning
from evolvent_massprops.inertia import Body, Stand, linear_model, vertical_model
from evolvent_massprops.inertia_stand import chart
from evolvent_papers.papers import stand, stand_error
from evolvent_papers.papers.stand import Grid
from evolvent_papers.papers.stand_pendulum_measures import identified

Values = Mapping[str, float]
#: Offset, m, at which sensitivities are taken.
AT = (0.4, 0.1)


def _over() -> Grid:
    return stand.grid()


def _three(values: np.ndarray, names: str) -> dict[str, float]:
    """Numbers by letters."""
    return dict(zip(names.split(), map(float, np.ravel(values)), strict=True))


@functools.cache
def _run(x: float, z: float) -> Any:
    """The built-in case at an offset, three modes identified."""
    return stand.simulated(x, z)[0]


def energies() -> Values:
    """Energies of the simulated modes at two offsets, J."""
    found = [_run(x, 0.0).mode_energy.values for x in (0.4, 0.8)]
    return _three(np.array(found), "heave_1 pitch_1 roll_1 heave_2 pitch_2 roll_2")


def sum_of_energies() -> Values:
    """Sum of the simulated modes' energies, J, without offset and at 0.4 m, and the closed form 3 F^2 / 8 k."""
    case = _over().case
    closed = 3.0 * case.excitation.force[1] ** 2 / (8.0 * case.stand.stiffness)
    middle, aside = (float(_run(x, 0.0).mode_energy.sum()) for x in (0.0, 0.4))
    return {"middle": middle, "aside": aside, "closed": closed}


def amplitudes() -> Values:
    """Amplitudes of the simulated modes at the four springs, mm, at 0.4 m."""
    names = " ".join(f"{mode}_{spring}" for mode in stand.NAMES for spring in range(1, 5))
    return _three(1e3 * _run(0.4, 0.0).mode_amplitude.values, names)


def distribution() -> Values:
    """Energy of the strongest over that of the weakest mode, without offset and at offsets along both axes."""
    over = _over()
    at = {"middle": (0.0, 0.0), "x_4": (0.4, 0.0), "x_8": (0.8, 0.0), "z_17": (0.0, 0.174), "z_35": (0.0, 0.348)}
    energy = {name: over.energies(*offset) for name, offset in at.items()}
    return {name: float(values.max() / values.min()) for name, values in energy.items()}


def data() -> Values:
    """Numbers of the built-in case, SI units."""
    case = _over().case
    given, body = case.stand, case.body
    return {
        "mass": body.mass,
        "Ixx": body.inertia[0],
        "Iyy": body.inertia[1],
        "Izz": body.inertia[2],
        "stiffness": given.stiffness,
        "length": given.natural_length,
        "spacing": 2.0 * given.half_length,
        "width": 2.0 * given.half_width,
        "force": -case.excitation.force[1],
    }


def independent_heights() -> Values:
    """Number of independent motions in the simulated heights of the four attachments; less than 1e-3 is none."""
    size = np.linalg.svd(_run(0.4, 0.0).sensor_true.values, compute_uv=False)
    return {"modes": float(np.sum(size > 1e-3 * size[0]))}


def three_of_six() -> Values:
    """Largest share, %, of the energy that a vertical pull gives to sway, surge and yaw, over some offsets."""
    over, shares = _over(), []
    for at in ((0.4, 0.174), (0.4, -0.174), (0.8, 0.348)):
        modes = linear_model(over.stand, over.body(*at)).modes()
        energy = modes.energy(modes.release(over.case.excitation.force, over.stand.points[0]))
        shares.append(energy[~modes.vertical].sum() / energy.sum())
    return {"percent": 100.0 * float(max(shares))}


def limiters() -> Values:
    """Largest change of a frequency of heave, pitch and roll, ppm, by guides that hold the body sideways."""
    over, changes = _over(), []
    springs = over.stand
    held = Stand(points=springs.points, stiffness=springs.stiffness, length=springs.length, support="guided")
    for at in ((0.4, 0.174), (0.4, -0.174), (0.8, 0.348)):
        free, guided = (linear_model(one, over.body(*at)).modes() for one in (springs, held))
        ratio = guided.natural_frequency[guided.vertical] / free.natural_frequency[free.vertical]
        changes.append(np.abs(ratio - 1.0).max())
    return {"ppm": 1e6 * float(max(changes))}


def undeformed() -> Values:
    """Sag of the body on its springs, mm, and the energy, J, of the heave from undeformed springs; each mode's else."""
    over = _over()
    weight, k = over.case.body.mass * over.case.stand.gravity, 4.0 * over.case.stand.stiffness
    energy = weight**2 / (2.0 * k)
    return {"sag": 1e3 * weight / k, "energy": energy, "mode": float(over.energies(0.0, 0.0).max())}


def map_time() -> Values:
    """Points of the paper's map, and time of its computer for a point, s, and for a step of 6 ms of 12.24 s, ms."""
    points = float(_over().x.size * _over().z.size)
    return {"points": points, "point": 20.0 * 3600.0 / points, "step": 1e3 * 20.0 * 3600.0 / points / (12.24 / 6e-3)}


def quadrants() -> Values:
    """The map in the box of 20 % of the spacing: least and median energy, J, shares below 1 % of the middle's, %.

    `towards` and `away`: the centre of mass is moved along both axes towards the loaded spring, or away from it;
    `beside`: towards it along one axis and away along the other, or along one axis alone.
    """
    over = _over()
    data = stand.map_data(over)
    inside, top = chart.box(data)[1], float(over.energies(0.0, 0.0).max())
    one, best = (data[name].values for name in ("least_energy", "least_energy_best"))
    spring = over.stand.points[0]
    x, z = np.sign(np.round(over.x * spring[0], 9))[:, None], np.sign(np.round(over.z * spring[2], 9))[None, :]
    both = {"towards": (x > 0) & (z > 0), "away": (x < 0) & (z < 0)}
    both["beside"] = ~(both["towards"] | both["away"])
    shares = {name: 100.0 * float(np.mean(one[inside & part] < 0.01 * top)) for name, part in both.items()}
    return shares | {
        "points": float(inside.sum()),
        "median": float(np.median(one[inside])),
        "below": 100.0 * float(np.mean(one[inside] < 0.01 * top)),
        "least_beside": float(one[inside & both["beside"]].min()),
        "best_least": float(best[inside].min()),
        "best_median": float(np.median(best[inside])),
    }


def no_pitch() -> Values:
    """Where one load does not set all modes in motion.

    The x offset, m, at which the axis of pitch passes through the loaded spring; pitch's energy there, of the middle's;
    and the share of the map, %, in which every mode has more than 1 % of the middle's energy.
    """
    over = _over()
    reach, top = over.case.stand.half_length, float(over.energies(0.0, 0.0).max())
    at = float(scipy.optimize.brentq(lambda x: over.modes(x, 0.0).axes()[0][1, 0] - reach, 0.5, 1.19, xtol=1e-9))
    least = over.least_energies(over.x[:, None], over.z[None, :])[0]
    left = float(over.energies(at, 0.0)[1]) / top
    return {"at": at, "left": left, "share": 100.0 * float(np.mean(least > 0.01 * top))}


def first_lost() -> Values:
    """Offset along x, of the spacing, at which the weakest mode has 5 % of the middle's energy; a = 2 and 2.5 m.

    `radius` is the body's radius of inertia about z, m.
    """
    share, found = np.linspace(0.1, 0.3, 2001), dict[str, float]()
    over = _over()
    found["radius"] = float(np.sqrt(over.case.body.inertia[2] / over.case.body.mass))
    for name, a in (("a", 2.0), ("longer", 2.5)):
        given = Stand.rectangle(a, over.case.stand.half_width, stiffness=over.case.stand.stiffness, length=0.5)
        modes = vertical_model(given, over.body(2.0 * a * share, 0.0)).modes()
        least = modes.energy(modes.release(over.case.excitation.force, given.points[0])).min(axis=-1)
        found[name] = 100.0 * float(share[np.argmax(least < 0.05 * over.energies(0.0, 0.0).max())])
    return found


def frequencies() -> Values:
    """Frequencies of the simulated modes, rad/s, at 0, 0.4 and 0.8 m."""
    found = np.array([_run(x, 0.0).mode_frequency.values for x in (0.0, 0.4, 0.8)])
    return _three(found, "heave_0 pitch_0 roll_0 heave_4 pitch_4 roll_4 heave_8 pitch_8 roll_8")


def roll_frequency() -> Values:
    """Roll, rad/s, of half the body's diameter: linear, and as modified Euler at 6 ms steps it."""
    case = _over().case
    wide = Stand.rectangle(2.0, 0.87, stiffness=case.stand.stiffness, length=0.5)
    linear = float(linear_model(wide, _over().body(0.0, 0.0)).modes().natural_frequency[-1])
    return {"linear": linear, "stepped": linear * (1.0 + batch.amplification("modified-euler")(linear * 6e-3)[1])}


def _beyond(*, mass: float = 1.0, stiffness: float = 1.0) -> tuple[float, float]:
    """Distances of the axes of pitch and roll beyond the centre of mass, of a small offset; changes as factors."""
    over, small = _over(), 1e-4
    springs = over.stand
    given = Stand(points=springs.points, stiffness=stiffness * springs.stiffness, length=springs.length)
    found: list[float] = []
    for offset in ((small, 0.0), (0.0, small)):
        body = over.body(*offset)
        modes = vertical_model(given, Body(mass=mass * body.mass, centre=body.centre, inertia=body.inertia)).modes()
        kind = ("pitch", "roll")[len(found)]
        axis = 2 * len(found)
        found.append(float(modes.axes()[0][modes.kinds.index(kind), axis] / small - 1.0))
    return found[0], found[1]


def axes() -> Values:
    """Axes of pitch and roll beyond the centre of mass, of the offset, and the axis of pitch at 0.4 m, m."""
    pitch, roll = _beyond()
    return {"pitch": pitch, "roll": roll, "at": float(_over().modes(0.4, 0.0).axes()[0][1, 0])}


def axes_stiffness() -> Values:
    """Distance of the axes beyond the centre of mass, of the offset, with half and with twice the stiffness."""
    return _three(np.array([_beyond(stiffness=s) for s in (0.5, 2.0)]), "pitch_soft roll_soft pitch_stiff roll_stiff")


def axes_mass() -> Values:
    """Distance of the axes beyond the centre of mass, of the offset, with 0.8 and 2 times the mass."""
    return _three(np.array([_beyond(mass=m) for m in (0.8, 2.0)]), "pitch_light roll_light pitch_heavy roll_heavy")


def partial_frequencies() -> Values:
    """Heave, roll and pitch by the formulas, and the simulated ones without offset, rad/s."""
    formulas = inertia.partial_frequencies(_over().stand, _over().body(0.0, 0.0))
    simulated = _run(0.0, 0.0).mode_frequency.values
    return {**_three(formulas, "heave roll pitch"), **_three(simulated, "heave_run pitch_run roll_run")}


def candidates() -> Values:
    """Bodies that have the simulated motion's three frequencies at (0.4, 0.174) m, and the one that is like another.

    `count` is their number; `right` the error of the moments of that nearest to the body, %; `Ixx` and `Izz` are
    those of the one whose stiffness is next to it, by `stiffness` %; `stiffness_line` is the same at (0.4, 0) m.
    """
    over = _over()
    known = over.case.body.inertia

    def off(one: inertia.Candidate) -> float:
        return 100.0 * max(abs(one.Ixx / known[0] - 1.0), abs(one.Izz / known[2] - 1.0))

    found = {}
    for name, at in (("line", (0.4, 0.0)), ("", (0.4, 0.174))):
        bodies = inertia.candidates(over.stand, over.body(*at), _run(*at).mode_frequency.values)
        true = min(bodies, key=off)
        near = min((one for one in bodies if one is not true), key=lambda one: abs(one.stiffness - true.stiffness))
        found[f"stiffness_{name}".rstrip("_")] = 100.0 * (near.stiffness / true.stiffness - 1.0)
    return found | {"count": float(len(bodies)), "Ixx": near.Ixx, "Izz": near.Izz, "right": off(true)}


def signals() -> Values:
    """What is identified from sensors with noise of 0.1 mm at (0.4, 0.1) m, the number of modes not being given.

    Number of modes; largest errors of a frequency, ppm, and of an amplitude at a sensor, mm, against those of the same
    motion without noise.
    """
    noisy = stand.simulated(0.4, 0.1, identification__order="auto", sensors__noise=1e-4)[0]
    clean = _run(0.4, 0.1)
    found = {"modes": float(noisy.sizes["mode"]), "sensors": float(noisy.sizes["sensor"])}
    if noisy.sizes["mode"] != clean.sizes["mode"]:
        return found | {"frequency": 1e6, "amplitude": 1e3}
    apart = np.abs(noisy.mode_frequency.values / clean.mode_frequency.values - 1.0)
    amplitude = np.abs(noisy.mode_amplitude.values - clean.mode_amplitude.values)
    return found | {"frequency": 1e6 * float(apart.max()), "amplitude": 1e3 * float(amplitude.max())}


def paper_accuracy() -> Values:
    """Largest errors of the moments by the paper's method on its line, z offset 0 and x offset up to 0.8 m, %."""
    found = 100.0 * np.abs(stand_error.errors({}, [(x, 0.0) for x in (0.0, 0.2, 0.4, 0.6, 0.8)]))
    return _three(found.max(axis=0), "Ixx Izz")


def accuracy_off_the_line() -> Values:
    """Largest errors of the moments by the paper's method with offsets along both axes, %, and those of its step.

    `corner_Ixx` and `corner_Izz` are those at the corners of the box of 20 % of the spacing beside the loaded spring.
    """
    found = 100.0 * np.abs(stand_error.errors({}, stand_error.OFFSETS[3:]))
    step = 100.0 * np.array(stand_error.of_the_step())
    corners = 100.0 * np.abs(stand_error.errors({}, ((0.8, -0.348), (-0.8, 0.348))))
    return {
        **_three(found.max(axis=0), "Ixx Izz"),
        **_three(corners.max(axis=0), "corner_Ixx corner_Izz"),
        **_three(step, "step_Ixx step_Izz"),
    }


def scheme_order() -> Values:
    """Orders of the paper's scheme on an oscillator: of the frequency, and of position and velocity at whole periods.

    `lag` is that of the frequency at 80 steps a period, ppm.
    """
    counts = np.array([80, 160])
    lag = np.array([abs(batch.amplification("modified-euler")(2.0 * np.pi / n)[1]) for n in counts])
    ends = np.array([_one_period(int(n)) for n in counts])
    orders = np.log2(np.abs(ends[0] / ends[1]))
    return {"frequency": float(np.log2(lag[0] / lag[1])), "lag": 1e6 * float(lag[0]),
            "position": float(orders[0]), "velocity": float(orders[1])}  # fmt: skip


def _one_period(steps: int) -> tuple[float, float]:
    """Errors of position and velocity of y'' = -y after a period in so many steps of the paper's scheme."""
    h, y, v = 2.0 * np.pi / steps, 1.0, 0.0
    for _ in range(steps):
        middle = -(y + 0.5 * h * v - 0.125 * h**2 * y)
        y, v = y + h * v + 0.5 * h**2 * middle, v + h * middle
    return y - 1.0, v


def upright_instability() -> Values:
    """Time, s, in which a body that stands on pinned axial springs leaves the upright by a factor e."""
    over = _over()
    springs = over.stand
    upright = Stand(points=springs.points, stiffness=springs.stiffness, length=springs.length, support="standing")
    modes = linear_model(upright, over.body(0.0, 0.0)).modes(refuse_unstable=False)
    hanging = linear_model(springs, over.body(0.0, 0.0)).modes().natural_frequency
    return {"time": float(1.0 / np.sqrt(-modes.eigenvalue[0])), "lateral": float(hanging[0]), "yaw": float(hanging[2])}


def tilt() -> Values:
    """Error of Ixx, %, at a corner of the box, by three frequencies of the hanging body at its tilted equilibrium."""
    over = _over()
    body = over.body(0.8, 0.4 * over.case.stand.half_width)
    frequency = linear_model(over.stand, body).modes().natural_frequency[3:]
    found = identified(over.stand, body, frequency)
    return {"Ixx": 100.0 * float(found[0] / over.case.body.inertia[0] - 1.0)}


def plan() -> Values:
    """A planned measurement of the paper's body with the centre of mass aside: length, s, and what limits it, %."""
    description = {
        "signals": {"sensors": [{"column": f"sensor {k}", "point": k} for k in (1, 2, 3, 4)]},
        "stand": {
            "kind": "springs", "half_length": "2 m +- 0.3 mm", "half_width": "0.8696 m +- 0.3 mm",
            "stiffness": "740250 N/m +- 0.1 %", "natural_length": "0.5 m +- 1 mm",
        },
        "body": {
            "mass": "15190 +- 3 kg", "offset_x": "0.3 m +- 0.5 mm", "offset_z": "0.1 m +- 0.5 mm",
            "height": "0 +- 5 mm", "Ixx": "unknown near 3703 kg m^2", "Iyy": "43920 kg m^2 +- 5 %",
            "Izz": "unknown near 43920 kg m^2", "Ixz": "0 +- 20 kg m^2",
        },
        "plan": {"force": "9806.65 N", "noise": "0.1 mm", "rate": "32 Hz"},
    }  # fmt: skip
    found, small = planning.plan(description, 2e-3), planning.plan(description, 1e-3)
    return {
        "length": found.best.duration,
        "reached": float(found.best.reached),
        "floor": 100.0 * small.best.worst,
        "noise": 100.0 * float(np.nanmax(small.best.noise)),
    }
