"""What the claims of Belyakov (2002) are measured by; each function returns numbers by name."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import Any

import numpy as np

from evolvent import batch
from evolvent.massprops import inertia
from evolvent.massprops.inertia import Body, Stand, from_three_frequencies, linear_model, vertical_model
from evolvent.papers import stand
from evolvent.papers.stand import Grid

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
    """Amplitudes of the simulated modes at spring 1, mm, at 0.4 m."""
    return _three(1e3 * _run(0.4, 0.0).mode_amplitude.values[:, 0], "heave pitch roll")


def least_energies() -> Values:
    """The map in the box of 20 % of the spacing: least and median energy, share below 1 % of the middle's."""
    from evolvent.systems.inertia_stand import chart

    data = stand.map_data(_over())
    inside, top = chart.box(data)[1], float(_over().energies(0.0, 0.0).max())
    one, best = (data[name].values[inside] for name in ("least_energy", "least_energy_best"))
    return {
        "points": float(inside.sum()),
        "least": float(one.min()),
        "median": float(np.median(one)),
        "below": 100.0 * float(np.mean(one < 0.01 * top)),
        "best_least": float(best.min()),
        "best_median": float(np.median(best)),
    }


def no_pitch() -> Values:
    """The x offset, m, at which the axis of pitch passes through the loaded spring and pitch gets no energy."""
    from scipy.optimize import brentq

    over = _over()
    reach = over.case.stand.half_length
    return {"at": float(brentq(lambda x: over.modes(x, 0.0).axes()[0][1, 0] - reach, 0.5, 1.19, xtol=1e-9))}


def first_lost() -> Values:
    """Offset along x, of the spacing, at which the weakest mode has 5 % of the middle's energy; a = 2 and 2.5 m."""
    share, found = np.linspace(0.1, 0.3, 2001), {}
    over = _over()
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


def axes() -> Values:
    """Axis of pitch at an offset of 0.4 m, m; its distance from the centre of mass and the roll's, of the offset."""
    over, small = _over(), 1e-4
    pitch = over.modes(small, 0.0).axes()[0][1, 0] / small - 1.0
    roll = over.modes(0.0, small).axes()[0][2, 2] / small - 1.0
    return {"pitch": float(pitch), "roll": float(roll), "at": float(over.modes(0.4, 0.0).axes()[0][1, 0])}


def partial_frequencies() -> Values:
    """Heave, roll and pitch without coupling, rad/s."""
    return _three(inertia.partial_frequencies(_over().stand, _over().body(0.0, 0.0)), "heave roll pitch")


def candidates() -> Values:
    """Number of bodies that have the same three frequencies, and the moments of the one next to the true stiffness."""
    over = _over()
    found = inertia.candidates(over.stand, over.body(0.4, 0.174), over.modes(0.4, 0.174).natural_frequency)
    k = over.case.stand.stiffness
    near = min((c for c in found if abs(c.stiffness / k - 1.0) > 1e-6), key=lambda c: abs(c.stiffness - k))
    return {
        "count": float(len(found)),
        "stiffness": 100.0 * (near.stiffness / k - 1.0),
        "Ixx": near.Ixx,
        "Izz": near.Izz,
    }


def paper_accuracy() -> Values:
    """Largest errors of the moments by the paper's method over some offsets, %, and those that its step makes."""
    from evolvent.papers import stand_error

    found = 100.0 * np.abs(stand_error.errors({}))
    step = 100.0 * np.array(stand_error.of_the_step())
    return {**_three(found.max(axis=0), "Ixx Izz"), **_three(step, "step_Ixx step_Izz")}


def _identified(given: Stand, body: Body, frequency: np.ndarray) -> np.ndarray:
    """(2,) Ixx, Izz by three frequencies, the solution whose shapes agree."""
    shapes = vertical_model(_over().stand, _over().body(body.centre[0], body.centre[2])).modes().at(given.points)
    found = from_three_frequencies(given, body, frequency, shapes=shapes, points=given.points)
    return np.array([found["Ixx"], found["Izz"]])


def beside_pendulum() -> Values:
    """Standard uncertainties, %, of Ixx and Izz by the stand and by a pendulum 2 m below its pivot.

    Frequencies to 100 ppm, lengths to 0.5 mm (a and b to 0.3 mm), the mass to 0.02 %, stiffnesses to 0.1 %.
    """
    from evolvent.massprops.inertia.pendulums import budget, compound

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
    by_pendulum = []
    for moment in (case.body.inertia[0], case.body.inertia[2]):
        w = np.sqrt(mass * 9.80665 * 2.0 / (moment + 4.0 * mass))
        known = {"frequency": float(w), "mass": mass, "distance": 2.0}
        found = budget(compound, known, {"frequency": 1e-4 * float(w), "mass": 2e-4 * mass, "distance": 5e-4})
        by_pendulum.append(100.0 * float(np.linalg.norm(found.contribution)) / moment)
    return {**_three(by_stand, "stand_xx stand_zz"), **_three(np.array(by_pendulum), "pendulum_xx pendulum_zz")}


def scheme_order() -> Values:
    """Orders of modified Euler for the frequency of an oscillation, the position and velocity at a whole period."""
    theta = 2.0 * np.pi / np.array([80.0, 160.0])
    lag = [abs(batch.amplification("modified-euler")(value)[1]) for value in theta]
    found = np.log2(np.array(lag[:1]) / lag[1:])
    return {"frequency": float(found[0]), "lag": 1e6 * float(lag[0]), "theory": 1e6 * float(theta[0] ** 2 / 48.0)}


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


def prony_exact() -> Values:
    """Error of Prony's frequencies without noise, of 100 samples, ppm; what is below 0.001 counts as that."""
    from evolvent.papers.stand_prony import Record, accuracy, plain_prony

    return {"ppm": max(1e6 * accuracy(plain_prony, Record(noise=0.0), 1).error, 1e-3)}


def prony() -> Values:
    """Errors of the worst frequency, %, of 100 samples with 1 % noise at 2.1 to 9 samples a period, and VARPRO's."""
    from evolvent.papers.stand_prony import TABLE_RATES, Record, accuracy, maximum_likelihood, plain_prony

    rates = [Record(per_period=rate) for rate in TABLE_RATES]
    found = {f"p{10 * r.per_period:g}": 100.0 * accuracy(plain_prony, r, 200).error for r in rates}
    return found | {"varpro": 100.0 * accuracy(maximum_likelihood, Record(), 50).error}


def prony_best() -> Values:
    """Samples a period at which Prony's error is least, of 100 samples with 1 % noise, and that error, %."""
    from evolvent.papers.stand_prony import Record, accuracy, plain_prony

    rates = np.arange(2.1, 3.05, 0.1)
    errors = [100.0 * accuracy(plain_prony, Record(per_period=float(rate)), 200).error for rate in rates]
    return {"best": float(rates[int(np.argmin(errors))]), "error": float(min(errors))}
