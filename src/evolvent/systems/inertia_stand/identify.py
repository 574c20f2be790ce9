"""From a run's signals to modes and inertia, with nothing of the truth but what a laboratory would know."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from evolvent import batch
from evolvent import inertia as weigh
from evolvent.errors import InputError
from evolvent.identification import Modes, identify
from evolvent.identification.signals import read_signal
from evolvent.identification.variable_projection import fit
from evolvent.inertia.least_squares import solve
from evolvent.inertia.problem import mac, problem
from evolvent.systems.inertia_stand.prepare import COMPONENTS, distinct

if TYPE_CHECKING:
    import xarray as xr

    from evolvent.systems.inertia_stand.prepare import Prepared

#: Amplitude, of the largest, above which a mode of the linear model is looked for in signals without noise.
SEEN = 1e-3
#: Frequencies of an identified mode and of its partner in the linear model differ by at most so much, relatively.
PARTNER = 0.05
#: Change of a frequency by the size of the swing, relatively, below which nobody is told.
SWING = 1e-5


#: What is said of methods that give no deviations, where the signals hold noise.
PLAIN = {
    name: f"{name} gives no standard deviations; take varpro" for name in ("esprit", "matrix-pencil", "tls-prony")
} | {"prony": "noise biases the frequencies and decay rates of prony, which gives no standard deviations; take varpro"}


class Swing(NamedTuple):
    """What the size of the swing does.

    Attributes
    ----------
    shift : (m,) relative difference of the identified modes' frequencies from those of small motion; NaN where unknown
    bias : of the identified numbers that shift makes, by name; NaN where a mode is none of the linear model's, empty
        where no inertia was asked for
    """

    shift: np.ndarray
    bias: dict[str, float]


def identified(item: Prepared, measured: np.ndarray, true: np.ndarray) -> dict[str, xr.Variable]:
    """Modes and inertia read from the signals, as variables of a run; not a number where the signals do not tell.

    Parameters
    ----------
    item : Prepared
    measured : (nt, c) float, m, what the sensors read
    true : (nt, c) float, m, the same without noise, from which the effect of the swing's size is told
    """
    chosen = item.case.identification
    order = _order(item)
    modes, body, reason, swing = None, None, "", None
    try:
        if order == 0:
            raise InputError("no mode of the linear model moves a sensor along its direction; turn or move the sensors")
        modes = identify(
            measured,
            rate=item.case.sensors.rate,
            method=chosen.method.replace("-", "_"),
            order=order,
            names=[f"sensor {k + 1}" for k in range(measured.shape[1])],
        )
        if chosen.way != "none":
            body = inertia_of(item, modes)
    except InputError as error:
        reason = str(error)
    except np.linalg.LinAlgError as error:
        reason = f"the modes give no inertia by {chosen.way}: its equations have no solution ({error})"
    if modes is not None:
        swing = swing_of(item, modes, body, true)
    return _variables(item, modes, body, swing, reason, order)


def swing_of(item: Prepared, modes: Modes, body: weigh.Inertia | None, true: np.ndarray) -> Swing:
    """How far the swing's frequencies are from those of small motion, and the inertia from what these would give.

    Notes
    -----
    The modes of the motion without noise against those of the linear model, as the integration's method steps them.
    """
    shift = np.full(modes.order, np.nan)
    pairs = partners(item, modes)
    try:
        signal = read_signal(true[:, np.ptp(true, axis=0) > 0.0], rate=item.case.sensors.rate)
        found = fit(modes.pole, signal)
    except (InputError, np.linalg.LinAlgError):  # poles of other methods may be no start
        return Swing(shift, {})
    if not found.converged:
        return Swing(shift, {})
    frequency = found.point.poles.imag
    for i, j in pairs.items():
        small = item.modes.frequency[j] * (1.0 + _numerical(item, float(item.modes.frequency[j])))
        shift[i] = frequency[i] / small - 1.0
    if body is None:
        return Swing(shift, {})
    if np.any(np.isnan(shift)):
        return Swing(shift, dict.fromkeys(body.identified, np.nan))
    try:
        small_body = inertia_of(item, dataclasses.replace(modes, frequency=modes.frequency / (1.0 + shift)))
    except (InputError, np.linalg.LinAlgError):
        return Swing(shift, {})
    return Swing(shift, {name: body[name] - small_body[name] for name in body.identified})


def _numerical(item: Prepared, frequency: float) -> float:
    """Relative error of a frequency by the method with a fixed step."""
    if item.steps == 0:
        return 0.0
    step = 1.0 / item.case.sensors.rate / item.steps
    return batch.amplification(item.case.solver.method)(frequency * step)[1]


def _told(item: Prepared, modes: Modes, swing: Swing, body: weigh.Inertia | None) -> list[str]:
    """A sentence where the size of the swing shows in frequencies or moments, beyond their deviations."""
    shift = np.abs(swing.shift)
    if body is not None and swing.bias and (strange := np.flatnonzero(np.isnan(shift))).size:
        listed = ", ".join(f"{w:.6g}" for w in modes.frequency[strange])
        return [
            f"the linear model has no mode within {PARTNER:.0%} of those identified at {listed} rad/s, so the inertia "
            f"means little and gets no standard deviation; swing less, or see what else the signals hold"
        ]
    if not np.any(shift > SWING):
        return []
    moments = [k for k in ("Ixx", "Iyy", "Izz") if k in swing.bias] if body is not None else []
    beyond = np.any((shift > SWING) & ~(shift * modes.frequency < modes.frequency_std))
    if not beyond and not any(abs(swing.bias[k]) > body.std[k] for k in moments if body is not None):
        return []
    largest = 100.0 * np.nanmax(shift)
    text = f"the swing is large: its frequencies differ from those of small motion by up to {largest:.2g} %"
    if moments and body is not None:
        most = 100.0 * max(abs(swing.bias[k] / body[k]) for k in moments)
        text += f", and so the moments by up to {most:.2g} %, which their standard deviations include"
    return [f"{text}; swing less"]


def _order(item: Prepared) -> int | None:
    """Number of modes to look for; None: as the signals say."""
    chosen, sensors = item.case.identification, item.case.sensors
    if chosen.order != "auto":
        return int(chosen.order)
    if np.any(sensors.noise) or sensors.quantisation > 0.0:
        return None
    # without noise, whatever is above rounding would count as a mode: harmonics, and sway in the millionths
    seen = np.abs(item.modes.amplitude(item.z, item.case.sensor_points, item.case.sensor_directions)).max(axis=1)
    return int(np.sum(distinct(item.modes.natural_frequency[seen > SEEN * seen.max()])))


def _vertical(modes: Modes, item: Prepared) -> np.ndarray:
    """Which three identified modes are heave, roll and pitch: those that the linear model's are nearest to."""
    if modes.order == 3:
        return np.arange(3)
    raise InputError(
        f"{modes.order} modes were identified, but this way takes three; set identification.order, or see why the "
        f"signals show another number"
    )


def partners(item: Prepared, modes: Modes) -> dict[int, int]:
    """Number of the linear model's mode that each identified one is; without those that are none of its modes.

    Notes
    -----
    The assignment of least sum of |log frequency ratio| + 1 - MAC; what is more than `PARTNER` apart is no pair, nor is
    a mode that moves no sensor.
    """
    from scipy.optimize import linear_sum_assignment

    shapes = item.modes.at(item.case.sensor_points, item.case.sensor_directions)
    agreement = np.nan_to_num(mac(modes.mode_shapes().real[:, None], shapes[None]))
    apart = np.abs(np.log(modes.frequency[:, None] / item.modes.frequency))
    moved = np.abs(shapes).max(axis=1)
    apart[:, moved < 1e-12 * moved.max()] = np.inf
    cost = np.where(apart < PARTNER, apart + 1.0 - agreement, 3.0)  # any true pair costs less than none
    row, column = linear_sum_assignment(cost)
    return {int(i): int(j) for i, j in zip(row, column, strict=True) if apart[i, j] < PARTNER}


def inertia_of(item: Prepared, modes: Modes) -> weigh.Inertia:
    """Inertia by the way that the case asks for.

    Notes
    -----
    The ways `three-frequencies` and `fit` take as known: mass, centre of mass, products of inertia and Iyy (of which
    only Ixz counts much), the stand's geometry, the ratios of the springs' stiffnesses; the stiffness itself cancels.
    The ways `shapes` and `six-modes` know the stiffness, and find the mass and its centre too. No way uses the moments
    that it is to find: `fit` starts from what `three-frequencies` gives.
    """
    case, stand = item.case, item.stand
    points, directions = case.sensor_points, case.sensor_directions
    way = case.identification.way
    shapes = modes.mode_shapes()
    covariance = _natural_covariance(modes)
    m, c = shapes.real.shape
    blocks = shapes.covariance[2 * m :, 2 * m :].reshape(m, c, m, c)
    own = np.array([blocks[k, :, k, :] for k in range(m)])
    shape_covariance = own if np.all(np.isfinite(own)) else None
    if way in ("fit", "three-frequencies"):
        k = _vertical(modes, item)
        vertical = not np.any(directions - (0.0, 1.0, 0.0))
        found = weigh.from_three_frequencies(
            stand,
            item.body,
            modes.natural_frequency[k],
            frequency_covariance=covariance,
            shapes=shapes.real[k] if vertical else None,
            points=points if vertical else None,
        )
        if way == "three-frequencies":
            return found
        ratio = found["stiffness"] / float(np.mean(stand.stiffness))
        near = dataclasses.replace(stand, stiffness=stand.stiffness * ratio)
        begin = weigh.Body(mass=item.body.mass, centre=item.body.centre, inertia=found.tensor)
        p = problem(
            near,
            begin,
            ("stiffness", "Ixx", "Izz"),
            modes.natural_frequency[k],
            frequency_covariance=covariance,
        )
        return solve(p, "least squares", [p.start])  # from this root alone: the others fit the frequencies as well
    options: Any = {
        "shapes": shapes.real,
        "points": points,
        "frequency_covariance": covariance,
        "shape_covariance": shape_covariance,
    }
    if way == "shapes":
        return weigh.from_shapes(stand, item.body, modes.natural_frequency, model="full", **options)
    if modes.order != 6:
        raise InputError(f"{modes.order} modes were identified, but identification.way 'six-modes' takes six")
    return weigh.from_six_modes(stand, item.body, modes.natural_frequency, directions=directions, **options)


def _natural_covariance(modes: Modes) -> np.ndarray | None:
    """(m, m) of the undamped frequencies; None for methods that give none."""
    m, zeta = modes.order, modes.damping_ratio
    J = np.hstack([np.diag(np.sqrt(1.0 - zeta**2)), np.diag(zeta)])
    C = J @ modes.pole_covariance @ J.T
    return C if np.all(np.isfinite(C)) and m else None


def _variables(
    item: Prepared,
    modes: Modes | None,
    body: weigh.Inertia | None,
    swing: Swing | None,
    reason: str,
    order: int | None,
) -> dict[str, xr.Variable]:
    from evolvent.results import variable

    case, c = item.case, len(item.case.sensor_points)
    m = modes.order if modes is not None else order or 3
    mode, shape = ("mode",), ("mode", "sensor")
    blank = {"mode": np.full(m, np.nan), "shape": np.full((m, c), np.nan)}
    linear = np.full(m, np.nan)
    energy = energy_std = blank["mode"]
    if modes is not None:
        pairs = partners(item, modes)
        linear[list(pairs)] = item.modes.frequency[list(pairs.values())]
        energy, energy_std = _energies(item, modes, pairs)

    def of(name: str, kind: str) -> Any:
        return blank[kind] if modes is None else getattr(modes, name)

    rad, per_s = "rad s-1", "s-1"
    data = {
        "mode_frequency": variable(mode, of("frequency", "mode"), rad, "identified frequency"),
        "mode_frequency_std": variable(mode, of("frequency_std", "mode"), rad, "its standard deviation"),
        "mode_frequency_linear": variable(mode, linear, rad, "frequency of the linear model's nearest mode"),
        "mode_decay_rate": variable(mode, of("decay_rate", "mode"), per_s, "identified decay rate"),
        "mode_decay_rate_std": variable(mode, of("decay_rate_std", "mode"), per_s, "its standard deviation"),
        "mode_amplitude": variable(shape, of("amplitude", "shape"), "m", "identified amplitude at the sensor"),
        "mode_amplitude_std": variable(shape, of("amplitude_std", "shape"), "m", "its standard deviation"),
        "mode_phase": variable(shape, of("phase", "shape"), "rad", "identified phase at the sensor"),
        "mode_energy": variable(mode, energy, "J", "energy of the mode at t = 0, from its amplitudes"),
        "mode_energy_std": variable(mode, energy_std, "J", "its standard deviation"),
    }
    if modes is not None:
        data["sensor_fitted"] = variable(("time", "sensor"), modes.fitted, "m", "sum of the identified modes")
    values = np.full(6, np.nan)
    std = np.full(6, np.nan)
    more = {"mass": np.nan, "ex": np.nan, "ez": np.nan, "h": np.nan, "stiffness": np.nan}
    if body is not None:
        for k, name in enumerate(COMPONENTS):
            if f"I{name}" in body.identified:
                values[k] = body[f"I{name}"]
                std[k] = np.hypot(body.std[f"I{name}"], swing.bias.get(f"I{name}", 0.0) if swing else 0.0)
        more = {name: body[name] if name in body.identified else np.nan for name in more}
    component, note = ("component",), "kg m2"
    data |= {
        "inertia_identified": variable(component, values, note, "identified about the centre of mass, body axes"),
        "inertia_std": variable(component, std, note, "its standard deviation, from noise and the size of the swing"),
        "mass_identified": variable((), more["mass"], "kg", "identified mass"),
        "offset_x_identified": variable((), more["ex"], "m", "identified offset of the centre of mass"),
        "offset_z_identified": variable((), more["ez"], "m", "identified offset of the centre of mass"),
        "height_identified": variable((), more["h"], "m", "identified height of the attachment plane"),
        "stiffness_identified": variable((), more["stiffness"], "N/m", "identified stiffness, mean of the springs"),
    }
    said = [f"identification: {reason}"] if reason else []
    if modes is not None and swing is not None:
        said += _told(item, modes, swing, body)
    if _noisy(case) and case.identification.method in PLAIN:
        said.append(PLAIN[case.identification.method])
    said += [*(modes.warnings if modes is not None and _noisy(case) else ()), *(body.warnings if body else ())]
    data["inertia_identified"].attrs["warning"] = "; ".join(said)
    return data


def _noisy(case: Any) -> bool:
    """Whether the sensors add noise; without it a residual is what the modes do not hold, and never white."""
    return bool(np.any(case.sensors.noise)) or case.sensors.quantisation > 0.0


def _energies(item: Prepared, modes: Modes, linear: dict[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Energy of each mode, J, from its amplitudes, and its standard deviation.

    Notes
    -----
    With a vertical sensor at every spring E = sum k_i A_i^2 / 2, as in Belyakov (2002); else from the modal coordinate
    that fits the amplitudes best to the linear model's shape, omega^2 z^2 / 2. Not a number for what is no mode of the
    linear model.
    """
    case = item.case
    A, s = modes.amplitude, modes.amplitude_std
    energy, std = np.full(modes.order, np.nan), np.full(modes.order, np.nan)
    if case.sensors.points == "springs" and case.sensors.directions == "vertical":
        k, own = item.stand.stiffness, list(linear)
        energy[own], std[own] = weigh.spring_energies(k, A[own]), np.sqrt(np.sum((k * A[own] * s[own]) ** 2, axis=1))
        return energy, std
    shapes = item.modes.at(case.sensor_points, case.sensor_directions)
    signed = modes.mode_shapes().real
    for i, j in linear.items():
        u = shapes[j]
        z, z_std = u @ signed[i] / (u @ u), np.sqrt(np.sum((u * s[i]) ** 2)) / (u @ u)
        square = item.modes.natural_frequency[j] ** 2
        energy[i], std[i] = 0.5 * square * z * z, square * abs(z) * z_std
    return energy, std
