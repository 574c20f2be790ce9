"""What the claims of Belyakov (2002) are measured by; each function returns numbers by name."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import Any

import numpy as np

from evolvent import cases
from evolvent.massprops import inertia
from evolvent.massprops.inertia import Body, Stand, from_three_frequencies, linear_model, vertical_model
from evolvent.papers import stand
from evolvent.papers.stand import Grid
from evolvent.solvers import batch

Values = Mapping[str, float]
#: Offset, m, at which sensitivities are taken.
AT = (0.4, 0.1)


@functools.cache
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


def mode_count() -> Values:
    """Number of modes that the signals of four sensors are found to hold, and of energies by the paper's formula."""
    run = stand.simulated(0.4, 0.1, identification__order="auto", sensors__noise=1e-4)[0]
    return {"modes": float(run.sizes["mode"]), "sensors": float(run.sizes["sensor"])}


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


def schematic() -> Values:
    """Of the drawing: number of springs, their length and spacing along x, m, diameter of the body, m."""
    from evolvent.papers import stand_schematic

    given = _over().stand
    x = given.points[:, 0]
    return {
        "springs": float(len(x)),
        "length": float(given.length[0]),
        "spacing": float(x.max() - x.min()),
        "diameter": stand_schematic.DIAMETER,
    }


def independent_heights() -> Values:
    """Number of independent motions in the simulated heights of the four attachments; less than 1e-3 is none."""
    size = np.linalg.svd(_run(0.4, 0.0).sensor_true.values, compute_uv=False)
    return {"modes": float(np.sum(size > 1e-3 * size[0]))}


def stiffness_centre() -> Values:
    """Distance, mm, of the stiffness centre from the springs' middle: equal ones; one 1 % stiffer."""
    points, found = _over().stand.points, {}
    for name, more in (("equal", 0.0), ("stiffer", 0.01)):
        k = np.array([1.0 + more, 1.0, 1.0, 1.0])
        found[name] = 1e3 * float(np.linalg.norm(k @ points / k.sum()))
    return found


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


def release() -> Values:
    """Force that is left on the body at the start with the load on, of the load, at least 1e-9; (0.4, 0.174) m."""
    from evolvent.massprops.inertia import wrench
    from evolvent.systems.inertia_stand.structure import setup_of

    case = cases.load(stand.CASE, dict(zip(stand.KEYS, (0.4, 0.174), strict=True)))
    setup = setup_of(case)
    start, load = setup.start, np.array(case.excitation.force)
    left = wrench(setup.stand, setup.body, start.position, start.rotation)
    lever = start.rotation @ (setup.stand.points[0] - setup.body.centre)
    left = left + np.concatenate([load, np.cross(lever, load)])
    speed = float(np.linalg.norm(start.velocity) + np.linalg.norm(start.rate))
    return {"left": float(np.linalg.norm(left) / np.linalg.norm(load)), "speed": speed}


def map_time() -> Values:
    """Points of the paper's map, and time of its computer for a point, s, and for a step of 6 ms of 12.24 s, ms."""
    points = float(_over().x.size * _over().z.size)
    return {"points": points, "point": 20.0 * 3600.0 / points, "step": 1e3 * 20.0 * 3600.0 / points / (12.24 / 6e-3)}


def surface() -> Values:
    """The surface of least energies: number of points, largest energy, J, and that without offset."""
    over = _over()
    least = over.least_energies(over.x[:, None], over.z[None, :])[0]
    return {"points": float(least.size), "top": float(least.max()), "middle": float(over.energies(0.0, 0.0).min())}


def quadrants() -> Values:
    """The map in the box of 20 % of the spacing: least and median energy, J, shares below 1 % of the middle's, %.

    `towards` and `away`: the centre of mass is moved along both axes towards the loaded spring, or away from it;
    `beside`: towards it along one axis and away along the other, or along one axis alone.
    """
    from evolvent.systems.inertia_stand import chart

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
    from scipy.optimize import brentq

    over = _over()
    reach, top = over.case.stand.half_length, float(over.energies(0.0, 0.0).max())
    at = float(brentq(lambda x: over.modes(x, 0.0).axes()[0][1, 0] - reach, 0.5, 1.19, xtol=1e-9))
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
    """Number of bodies that have the same three frequencies, and the moments of the one next to the true stiffness.

    `true` is the error of the moments of the true one among them, %; 0 below 1e-6 %.
    """
    over = _over()
    found = inertia.candidates(over.stand, over.body(0.4, 0.174), over.modes(0.4, 0.174).natural_frequency)
    k = over.case.stand.stiffness
    true, body = min(found, key=lambda c: abs(c.stiffness - k)), over.body(0.4, 0.174)
    off = 100.0 * max(abs(true.Ixx / body.inertia[0, 0] - 1.0), abs(true.Izz / body.inertia[2, 2] - 1.0))
    near = min((c for c in found if abs(c.stiffness / k - 1.0) > 1e-6), key=lambda c: abs(c.stiffness - k))
    return {
        "count": float(len(found)),
        "stiffness": 100.0 * (near.stiffness / k - 1.0),
        "Ixx": near.Ixx,
        "Izz": near.Izz,
        "true": off if off > 1e-6 else 0.0,
    }


def paper_accuracy() -> Values:
    """Largest errors of the moments by the paper's method on its line, z offset 0 and x offset up to 0.8 m, %."""
    from evolvent.papers import stand_error

    found = 100.0 * np.abs(stand_error.errors({}, [(x, 0.0) for x in (0.0, 0.2, 0.4, 0.6, 0.8)]))
    return _three(found.max(axis=0), "Ixx Izz")


def accuracy_off_the_line() -> Values:
    """Largest errors of the moments by the paper's method with offsets along both axes, %, and those of its step."""
    from evolvent.papers import stand_error

    found = 100.0 * np.abs(stand_error.errors({}, stand_error.OFFSETS[3:]))
    step = 100.0 * np.array(stand_error.of_the_step())
    return {**_three(found.max(axis=0), "Ixx Izz"), **_three(step, "step_Ixx step_Izz")}


def pendulum_distance() -> Values:
    """Standard uncertainties of Ixx, %, by a pendulum at 2 m, at the radius of inertia and at 0.1 m from its pivot.

    Its frequency is known to 100 ppm, the distance of its centre of mass to 0.5 mm, its mass to 0.02 %. `ratio` is the
    moment about the pivot at 2 m over that about the centre of mass.
    """
    body = _over().case.body
    moment, mass = body.inertia[0], body.mass
    radius = float(np.sqrt(moment / mass))
    found = {n: _pendulum(moment, r) for n, r in (("far", 2.0), ("near_best", radius), ("near", 0.1))}
    return found | {"ratio": 1.0 + mass * 4.0 / moment, "at": radius}


def _pendulum(moment: float, distance: float) -> float:
    """Standard uncertainty, %, of a moment by a pendulum whose centre of mass is at a distance, m, from its pivot."""
    from evolvent.massprops.inertia.pendulums import budget, compound

    mass = _over().case.body.mass
    w = float(np.sqrt(mass * 9.80665 * distance / (moment + mass * distance**2)))
    known = {"frequency": w, "mass": mass, "distance": distance}
    found = budget(compound, known, {"frequency": 1e-4 * w, "mass": 2e-4 * mass, "distance": 5e-4})
    return 100.0 * float(np.linalg.norm(found.contribution)) / moment


def _identified(given: Stand, body: Body, frequency: np.ndarray) -> np.ndarray:
    """(2,) Ixx, Izz by three frequencies, the solution whose shapes agree."""
    shapes = vertical_model(_over().stand, _over().body(body.centre[0], body.centre[2])).modes().at(given.points)
    found = from_three_frequencies(given, body, frequency, shapes=shapes, points=given.points)
    return np.array([found["Ixx"], found["Izz"]])


def beside_pendulum() -> Values:
    """Standard uncertainties, %, of Ixx and Izz by the stand and by a pendulum 2 m below its pivot.

    Frequencies to 100 ppm, lengths to 0.5 mm (a and b to 0.3 mm), the mass to 0.02 %, stiffnesses to 0.1 %.
    """
    over = _over()
    case = over.case
    mass, frequency = case.body.mass, over.modes(*AT).natural_frequency
    values = [*frequency, case.stand.half_length, case.stand.half_width, *AT, mass, 1.0, 1.0, 1.0, 1.0]
    deviations = np.array([*(1e-4 * frequency), 3e-4, 3e-4, 5e-4, 5e-4, 2e-4 * mass, *[1e-3] * 4])

    def moments(x: np.ndarray) -> np.ndarray:
        given = Stand.rectangle(x[3], x[4], stiffness=case.stand.stiffness * x[8:], length=case.stand.natural_length)
        body = Body(mass=x[7], centre=[x[5], 0.0, x[6]], inertia=case.body.tensor)
        return _identified(given, body, x[:3])

    x = np.array(values)
    slopes = [moments(x + 0.5 * row) - moments(x - 0.5 * row) for row in np.diag(deviations)]
    by_stand = 100.0 * np.sqrt(np.sum(np.square(slopes), axis=0)) / np.array(case.body.inertia)[[0, 2]]
    by_pendulum = [_pendulum(case.body.inertia[k], 2.0) for k in (0, 2)]
    return {**_three(by_stand, "stand_xx stand_zz"), **_three(np.array(by_pendulum), "pendulum_xx pendulum_zz")}


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
    found = _identified(over.stand, body, frequency)
    return {"Ixx": 100.0 * float(found[0] / over.case.body.inertia[0] - 1.0)}


def height() -> Values:
    """Change of the roll's frequency, %, where the attachment plane is 0.1 m above the centre of mass."""
    over = _over()
    given = over.case.body
    raised = Body(mass=given.mass, centre=(0.0, -0.1, 0.0), inertia=given.tensor)
    level, high = (linear_model(over.stand, b).modes().natural_frequency[-1] for b in (over.body(0.0, 0.0), raised))
    return {"roll": 100.0 * float(high / level - 1.0)}


def swing() -> Values:
    """Largest relative difference of a simulated frequency from the linear model's, ppm; spring 1 moves by 10 mm."""
    run = _run(0.0, 0.0)
    apart = np.abs(run.mode_frequency.values / run.mode_frequency_linear.values - 1.0)
    return {"ppm": 1e6 * float(apart.max()), "move": 1e3 * float(np.abs(run.sensor_true.values[:, 0]).max())}


def product() -> Values:
    """Error of Izz, %, where principal axes are turned by 1 degree about the vertical and Ixz is taken as 0."""
    over, angle = _over(), np.radians(1.0)
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    level = over.body(0.4, 0.17)
    turned = Body(mass=level.mass, centre=level.centre, inertia=turn @ level.inertia @ turn.T)
    modes = linear_model(over.stand, turned).modes()
    springs = over.stand.points
    shapes = modes.at(springs)[3:]
    found = from_three_frequencies(over.stand, level, modes.natural_frequency[3:], shapes=shapes, points=springs)
    return {"Izz": 100.0 * float(found["Izz"] / turned.inertia[2, 2] - 1.0)}


def plan() -> Values:
    """A planned measurement of the paper's body with the centre of mass aside: length, s, and what limits it, %."""
    from evolvent.massprops import planning

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
