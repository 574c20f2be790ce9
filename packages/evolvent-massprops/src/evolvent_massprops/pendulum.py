"""Pendulums: from the frequency of a body on wires or about a pivot to its moment of inertia."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from evolvent_base.errors import InputError
from evolvent_massprops.description import Bifilar, CompoundPendulum, OnPivot, Pendulum, TorsionWire, Trifilar
from evolvent_massprops.estimates import Evaluation, Output, Share
from evolvent_massprops.identification.swing_laws import Swing
from evolvent_massprops.identification.swing_model import PENDULUM, Reach, Restoring
from evolvent_massprops.identification.swing_starts import Kind
from evolvent_massprops.inertia import pendulums
from evolvent_massprops.modal import Modal, refuse_rate, sensed
from evolvent_massprops.rounding import shown
from evolvent_massprops.uncertain import Uncertain

#: A mode within this share of the sway sqrt(g / H) is a sway.
SWAY = 0.05
#: The torsion mode must have this share of the strongest mode's amplitude, and no rival more than that of its own.
LEAST_SHARE, RIVAL = 0.05, 0.5
_UNITS = {"mass": "kg", "inertia": "kg m²", "gravity": "m/s²", "stiffness": "N m/rad", "wire_stiffness": "N m/rad"}

_STAND_KEYS = ("stiffness", "radius", "top_radius", "length", "distance", "amplitude", "wire_stiffness", "gravity")


#: Difference of a stated amplitude from that of the signals, of the latter, that is reported.
_AMPLITUDE = 0.05


def swing(given: Pendulum, unit: str, rate: float) -> Kind:
    """What the stand says of the swing, where sensors read it in `unit` at the rate, Hz.

    Raises
    ------
    InputError
        A body without mass on wires, a rate too low for its sway.

    Notes
    -----
    On wires that hang from R to r at the depth H(x) = sqrt(L^2 - R^2 - r^2 + 2 R r cos x) the body has the energy
    (I + M H'^2) x'^2 / 2 - M g H + kappa x^2 / 2.
    """
    stand = given.stand
    if isinstance(stand, (Bifilar, Trifilar)) and given.body.mass is None:
        raise InputError(f"body.mass is missing; on {stand.kind} wires the weight turns the body back")
    factor = sensed(unit).angle
    stated = getattr(stand, "amplitude", None)
    reach = Reach(factor, abs(stated.value) if stated else math.nan, stated.std if stated else math.nan)
    avoid = _sway(given)
    if avoid is not None:
        refuse_rate(avoid, rate, "the body's sway sqrt(g / H)")
    kind = Kind(PENDULUM, reach, avoid=math.nan if avoid is None else avoid)
    if isinstance(stand, CompoundPendulum):
        return kind
    if not isinstance(stand, (Bifilar, Trifilar)):
        return kind._replace(restoring=Restoring())
    r, R = stand.radius.value, (stand.top_radius or stand.radius).value
    mass = (given.body.mass.value if given.body.mass else 0.0) + sum(t.mass.value for t in given.tare if t.mass)
    square = stand.length.value**2 - r**2 - R**2
    depth = math.sqrt(square + 2.0 * r * R)
    weight, wire = mass * stand.gravity.value * r * R / depth, max(stand.wire_stiffness.value, 0.0)
    total = weight + wire
    return kind._replace(restoring=Restoring(weight / total, wire / total, r * R, square, mass / total))


class _Input(NamedTuple):
    key: str
    value: float
    std: float
    unit: str


def evaluate(given: Pendulum, modal: Modal, own: Sequence[str] = ()) -> Evaluation:
    """The moment of inertia from one recording.

    Raises
    ------
    InputError
        No mode or several that may be the torsion, a swing faster than that of a point mass, a moment that is not
        above 0.
    """
    k, why = _rotation(given, modal, _sway(given))
    followed = _followed(modal, k)
    swung = modal.modes.swings[k] if modal.modes.swings else None
    if swung is not None:
        why = (*why, f"It is fitted as one swing: {swung}.")
    inputs = [i for i in _inputs(given) if followed is None or i.key != "stand.amplitude"]
    at = {i.key: i.value for i in inputs}
    w, std = float(modal.frequency[k]), float(modal.frequency_std[k])
    _refuse_fast(given, w)
    values = _moments(given, {key: np.asarray(v) for key, v in at.items()}, np.asarray(w))
    outputs = _outputs(given)
    for output, value in zip(outputs, values, strict=True):
        if not value > 0.0:
            raise InputError(
                f"the data give {output.key} = {value:.6g} kg m2, which no body has; check masses, "
                f"{'stand.distance' if isinstance(given, OnPivot) else 'wires'} and the tare"
            )
    shares = []
    for i in inputs:
        if i.std > 0.0:
            sides = []
            for sign in (0.5, -0.5):
                moved = {key: np.asarray(v + sign * i.std * (key == i.key)) for key, v in at.items()}
                sides.append(_moments(given, moved, np.asarray(w)))
            shares.append(Share(i.key, i.unit, i.value, i.std, sides[0] - sides[1], i.key in own))
    if math.isfinite(std):
        every = {key: np.asarray(v) for key, v in at.items()}
        slope = _moments(given, every, np.asarray(w + 0.5 * std)) - _moments(given, every, np.asarray(w - 0.5 * std))
        shares.append(Share("noise: frequency", "rad/s", w, std, slope, True))
    C = np.array([s.contribution for s in shares]).reshape(len(shares), len(values))
    draws = None
    covariance = C.T @ C
    if given.uncertainty.method == "monte-carlo":
        random, n = np.random.default_rng(given.uncertainty.seed), given.uncertainty.draws
        drawn = {i.key: i.value + i.std * random.standard_normal(n) for i in inputs}
        try:
            draws = _moments(given, drawn, w + (std if math.isfinite(std) else 0.0) * random.standard_normal(n)).T
        except InputError as error:
            what = "a pendulum can have" if isinstance(given, OnPivot) else "the wires can hold"
            raise InputError(f"the Monte Carlo leaves what {what}: {error}") from None
        covariance = np.atleast_2d(np.cov(draws, rowvar=False))
    others = tuple(f"mode {j + 1} (" for j in range(modal.modes.order) if j != k)
    warnings = [text for text in modal.warnings if not text.startswith(others)]
    warnings += _amplitude_warnings(given, modal, followed)
    if modal.reading.time[-1] * w < 10.0 * math.pi:
        warnings.append(
            f"the {_mode(given)} is seen for {modal.reading.time[-1] * w / (2.0 * math.pi):.1f} periods only"
        )
    return Evaluation(
        modal=modal,
        used=(k,),
        outputs=outputs,
        values=values,
        covariance=covariance,
        shares=tuple(shares),
        why=why,
        assumed=(*_assumed(given, inputs), *_reach(followed)),
        cannot=_CANNOT,
        model_frequency=np.array([np.nan]),
        agreement=np.array([np.nan]),
        draws=draws,
        warnings=tuple(warnings),
    )


def _followed(modal: Modal, k: int) -> Swing | None:
    """The swing of mode k whose frequency is that at zero amplitude; None where it was not fitted so."""
    found = modal.modes.swings[k] if modal.modes.swings else None
    return found if found is not None and found.follows_amplitude else None


def _reach(followed: Swing | None) -> tuple[tuple[str, str], ...]:
    if followed is None or not math.isfinite(followed.amplitude):
        return ()
    first, std = (math.degrees(x) for x in (followed.amplitude, followed.amplitude_std))
    return (("amplitude", f"from the signals: {shown(first, std)} deg at first, {followed.last:.2g} of it at the end"),)


def _amplitude_warnings(given: Pendulum, modal: Modal, followed: Swing | None) -> list[str]:
    """What is to be said of the amplitude that was used."""
    stand = given.stand
    stated: Uncertain | None = getattr(stand, "amplitude", None)
    if isinstance(stand, TorsionWire):
        return []
    if followed is None:
        if stated is not None:
            return []
        return [
            "the swing was not followed through its amplitudes, and stand.amplitude is not given: it is taken as small"
        ]
    if stated is None:
        seen = math.isfinite(followed.component.reach.factor) or followed.amplitude > 2.0 * followed.amplitude_std
        return [] if seen else [
            "the signals are no angles, and the rate of the swing does not show its amplitude: u holds up to "
            f"{math.degrees(2.0 * followed.amplitude_std):.2g} deg; give stand.amplitude to reduce it"
        ]  # fmt: skip
    mean = followed.amplitude * float(followed.component.envelope(modal.modes.time).mean())
    if abs(mean - abs(stated.value)) <= max(3.0 * math.hypot(stated.std, followed.amplitude_std), _AMPLITUDE * mean):
        return []
    return [
        f"stand.amplitude is {math.degrees(stated.value):.3g} deg, but the signals show {math.degrees(mean):.3g} deg "
        "in the mean: that of the signals is used"
    ]


_CANNOT = (
    ("moments about other axes, products of inertia", "the body turns about one axis only; turn it over on the wires"),
    ("mass and offset of the centre of mass", "the torsion mode does not determine them; measure them separately"),
)


def _outputs(given: Pendulum) -> tuple[Output, ...]:
    found = [Output("I", "moment of inertia about the axis of rotation", "kg m²")]
    if isinstance(given, OnPivot) or given.body.offset is not None:
        found.append(Output("I_own", "moment of inertia about the parallel axis through its centre of mass", "kg m²"))
    return tuple(found)


def _inputs(given: Pendulum) -> list[_Input]:
    """All numbers that the moment depends on, by key."""
    found: list[_Input] = []

    def add(key: str, value: Uncertain | None) -> None:
        if value is not None:
            unit = _UNITS.get(key.rpartition(".")[2], "rad" if key.endswith("amplitude") else "m")
            found.append(_Input(key, value.value, value.std, unit))

    stand = given.stand
    for key in _STAND_KEYS:
        add(f"stand.{key}", getattr(stand, key, None))
    add("body.mass", given.body.mass)
    if not isinstance(given, OnPivot):
        add("body.offset", given.body.offset)
    for k, tare in enumerate(given.tare):
        for key in ("mass", "radius", "inertia"):
            add(f"tare.{k}.{key}", getattr(tare, key))
    clock = given.signals.clock
    found.append(_Input("signals.clock", clock.value, clock.std, "1"))
    return found


def _moments(given: Pendulum, x: dict[str, np.ndarray], frequency: np.ndarray) -> np.ndarray:
    """(p, ...) the outputs for numbers by key; the frequency is in time by the clock's value."""
    w = frequency * given.signals.clock.value / x["signals.clock"]
    mass = x.get("body.mass", np.asarray(0.0))
    tare, hanging, lever = np.asarray(0.0), mass, np.asarray(0.0)
    for k, _ in enumerate(given.tare):
        own, radius = x.get(f"tare.{k}.mass", np.asarray(0.0)), x[f"tare.{k}.radius"]
        hanging, lever = hanging + own, lever + own * radius
        tare = tare + own * radius**2 + x[f"tare.{k}.inertia"]
    if isinstance(given.stand, CompoundPendulum):
        # of all that swings: its centre of mass, and from the moment about that the one about the pivot
        distance = (mass * x["stand.distance"] + lever) / hanging
        amplitude, gravity = np.abs(x.get("stand.amplitude", 0.0)), x["stand.gravity"]
        whole = pendulums.compound(w, mass=hanging, distance=distance, amplitude=amplitude, gravity=gravity)
        whole = whole + hanging * distance**2
    elif isinstance(given.stand, (Bifilar, Trifilar)):
        whole = pendulums.multifilar(
            w,
            mass=hanging,
            length=x["stand.length"],
            radius=x["stand.radius"],
            radius_above=x.get("stand.top_radius"),
            amplitude=np.abs(x.get("stand.amplitude", 0.0)),
            wire_stiffness=np.maximum(x["stand.wire_stiffness"], 0.0),
            gravity=x["stand.gravity"],
        )
    else:
        whole = pendulums.torsion(w, stiffness=x["stand.stiffness"])
    rows = [whole - tare]
    own_distance = x.get("stand.distance", x.get("body.offset"))
    if own_distance is not None:
        rows.append(whole - tare - mass * own_distance**2)
    return np.array(np.broadcast_arrays(*rows), dtype=float)


def _refuse_fast(given: Pendulum, frequency: float) -> None:
    """Refuse a swing, rad/s, that is faster than that of a point mass where the body's centre of mass is."""
    if not isinstance(given, OnPivot) or given.tare:
        return
    distance, gravity = given.stand.distance.value, given.stand.gravity.value
    fastest = math.sqrt(gravity / distance)
    if frequency >= fastest:
        raise InputError(
            f"stand.distance is {distance:g} m, but the body swings at {frequency:.6g} rad/s; a point mass there has "
            f"{fastest:.6g} rad/s, and every body less; check stand.distance and the time of the signals"
        )


def _sway(given: Pendulum) -> float | None:
    """Frequency at which the body sways on its wires, rad/s."""
    if not isinstance(given.stand, (Bifilar, Trifilar)):
        return None
    s = given.stand
    lean = s.radius.value - (s.top_radius or s.radius).value
    square = s.length.value**2 - lean**2
    if square <= 0.0:
        raise InputError(f"stand.length is {s.length.value:g} m; such wires do not reach from top_radius to radius")
    return math.sqrt(s.gravity.value / math.sqrt(square))


def _rotation(given: Pendulum, modal: Modal, sway: float | None) -> tuple[int, tuple[str, ...]]:
    """The mode in which the body turns about the axis, and why."""
    strength = np.sqrt(np.sum(modal.modes.amplitude**2, axis=1))
    w = modal.frequency
    band = given.identification.band
    swaying = np.zeros(len(w), dtype=bool)
    why = []
    if sway is not None and band is None:
        swaying = np.abs(w / sway - 1.0) < SWAY
        if swaying.any():
            listed = ", ".join(f"{x:.6g}" for x in w[swaying])
            why.append(
                f"A body on these wires sways at sqrt(g / H) = {sway:.5g} rad/s; so does the mode at {listed} rad/s."
            )
    left = [int(k) for k in np.argsort(-strength) if not swaying[k] and k not in modal.hum]
    ask = f"give identification.band around the {_mode(given)}, such as [5 rad/s, 7 rad/s]"
    if not left or strength[left[0]] < LEAST_SHARE * strength.max():
        raise InputError(f"no mode but the sway at {sway:.6g} rad/s is above the noise; {ask}")
    if len(left) > 1 and strength[left[1]] > RIVAL * strength[left[0]]:
        a, b = w[left[0]], w[left[1]]
        raise InputError(
            f"the modes at {a:.6g} and {b:.6g} rad/s are about as strong, either may be the "
            f"{_mode(given, short=True)}; {ask}"
        )
    share = f", {strength[left[1]] / strength[left[0]]:.1%} of it the next" if len(left) > 1 else ""
    other = "of the others " if swaying.any() else ""
    why.append(f"The {_mode(given)} is the strongest {other}at the sensors: {w[left[0]]:.6g} rad/s{share}.")
    return left[0], tuple(why)


def _mode(given: Pendulum, *, short: bool = False) -> str:
    """What the mode is called in which the body turns about the axis."""
    return "swing" if isinstance(given, OnPivot) else "torsion" if short else "torsion mode"


def _assumed(given: Pendulum, inputs: list[_Input]) -> tuple[tuple[str, str], ...]:
    rows = []
    for i in inputs:
        name = i.key
        if name.startswith("tare."):
            _, k, what = name.split(".")
            name = f"{given.tare[int(k)].name}: {what}"
        exact = "" if i.std > 0.0 else ", taken as exact"
        rows.append((name, f"{shown(i.value, i.std)} {i.unit if i.unit != '1' else ''}".rstrip() + exact))
    if isinstance(given, OnPivot):
        rows.append(("pivot", "a fixed horizontal axis without friction; all that swings hangs straight below it"))
    else:
        rows.append(
            ("wires", "without mass and stretch; the axis of rotation through the centre of mass of all that hangs")
        )
    return tuple(rows)
