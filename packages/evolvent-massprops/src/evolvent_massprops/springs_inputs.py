"""What is known of a body on springs: stand, sensors, first guess of the body, inputs with an uncertainty."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from evolvent_base.errors import InputError
from evolvent_massprops.description import OnSprings
from evolvent_massprops.inertia import Body, Stand
from evolvent_massprops.inertia.stand import Mounting, inertia_defect
from evolvent_massprops.keys import DIRECTIONS
from evolvent_massprops.modal import Modal
from evolvent_massprops.rounding import shown
from evolvent_massprops.spring_keys import CALIBRATED, PROPERTIES
from evolvent_massprops.uncertain import Uncertain

#: Name and unit of every quantity that may be asked for.
LABELS = {
    "mass": ("mass", "kg"),
    "offset_x": ("centre of mass, x offset", "m"),
    "height": ("height of the attachment plane above the centre of mass", "m"),
    "offset_z": ("centre of mass, z offset", "m"),
    **{f"I{a}{a}": (f"moment of inertia about {a}", "kg m²") for a in "xyz"},
    **{f"I{ab}": (f"product of inertia {ab} (element of the tensor)", "kg m²") for ab in ("xy", "xz", "yz")},
    "common_factor": ("common factor on the stiffnesses", "1"),
    "half_length": ("half the distance of the springs along x", "m"),
    "half_width": ("half the distance of the springs along z", "m"),
}


class Input(NamedTuple):
    """A known number that is uncertain: what `moved` changes, its key for the user, value, std, unit.

    `recordings` are the numbers of those that it acts on; None for all.
    """

    target: tuple[Any, ...]
    key: str
    value: float
    std: float
    unit: str
    recordings: tuple[int, ...] | None = None


class Asked(NamedTuple):
    """An unknown: its key for the user, its name in `evolvent_massprops.inertia.problem.assign`, what is stated."""

    key: str
    name: str
    stated: Uncertain


def asked(given: OnSprings) -> list[Asked]:
    """Unknowns of body, tare, mounting and springs."""
    found = [Asked(key, PROPERTIES[key], getattr(given.body, key)) for key in given.body.unknown]
    for k, keys in enumerate(given.unknown_of_tare):
        found += [
            Asked(f"tare.{k}.{key}", f"tare{k + 1}_{PROPERTIES[key]}", getattr(given.tare[k], key)) for key in keys
        ]
    if given.mounting is not None and given.mounting.body:
        for axis, value in zip("xyz", given.mounting.position, strict=True):
            if value.unknown:
                found.append(Asked(f"mounting.position.{axis}", f"position_{axis}", value))
    found += [Asked(key, CALIBRATED[key], getattr(given.stand, key)) for key in given.stand.unknown]
    return found


def label_of(key: str, given: OnSprings) -> tuple[str, str]:
    """Name and unit of a quantity that is asked."""
    if key in LABELS:
        return LABELS[key]
    first, _, last = key.partition("@")[0].rpartition(".")
    if first == "mounting.position":
        return f"position {last} of the body on the stand", "m"
    name, unit = LABELS[last]
    return f"{given.tare[int(first.split('.')[1])].name}: {name}", unit


def mounting_of(given: OnSprings) -> Mounting:
    """How the body is fixed to the stand, with tare and air; unknowns without a start at 0."""

    def number(value: Uncertain) -> float:
        return 0.0 if np.isnan(value.value) else value.value

    m, shapes = given.mounting, () if given.air is None else given.air.shapes
    found = Mounting() if m is None else Mounting(
        rotation=m.matrix, position=np.array([number(v) for v in m.position]), occupied=m.body
    )  # fmt: skip
    added = [shape.added() for shape in shapes]
    return found._replace(
        tare_mass=np.array([number(t.mass) for t in given.tare]),
        tare_centre=np.array([[number(t.offset_x), -number(t.height), number(t.offset_z)] for t in given.tare]).reshape(
            -1, 3
        ),
        tare_inertia=np.array(
            [[[number(getattr(t, "I" + "".join(sorted(a + b)))) for b in "xyz"] for a in "xyz"] for t in given.tare]
        ).reshape(-1, 3, 3),
        air_mass=np.array([mass for mass, _ in added]).reshape(-1, 3, 3),
        air_inertia=np.array([moments for _, moments in added]).reshape(-1, 3, 3),
        air_centre=np.array([shape.centre for shape in shapes]).reshape(-1, 3),
        air_on_body=tuple(shape.of == "body" for shape in shapes),
        air_factor=np.array([shape.factor.value for shape in shapes]),
        air_density=0.0 if given.air is None else given.air.density.value,
    )


class SpringsTask(NamedTuple):
    """What is to be solved: a description, the modes that are used, and what does not change during the search.

    Attributes
    ----------
    given : OnSprings
    modal : Modal
    used : tuple of int, modes, from 0
    stand : Stand
    sensors, directions : (c, 3) float, m and 1
    keys : tuple of str, unknowns as the user names them
    mean : float, N/m, mean stiffness of the springs
    """

    given: OnSprings
    modal: Modal
    used: tuple[int, ...]
    stand: Stand
    sensors: np.ndarray
    directions: np.ndarray
    keys: tuple[str, ...]
    mean: float


def stand_factor(given: OnSprings) -> float:
    """The common factor that the stand was set up with."""
    value = given.stand.common_factor.value
    return value if np.isfinite(value) else 1.0


def stand_of(given: OnSprings) -> Stand:
    """The stand, with the common factor on its stiffnesses."""
    s, n = given.stand, given.stand.number
    return Stand(
        points=s.attachment_points,
        stiffness=_each(s.stiffness, n) * stand_factor(given),
        length=_each(s.natural_length, n),
        damping=_each(s.damping, n),
        lateral_stiffness=_each(s.lateral_stiffness, n),
        lateral_damping=_each(s.lateral_damping, n),
        support=s.support,
        gravity=s.gravity.value,
    )


def _each(values: tuple[Uncertain, ...], n: int) -> np.ndarray:
    return np.broadcast_to(np.array([v.value for v in values]), (n,)).copy()


def first_body(
    given: OnSprings, stand: Stand, frequency: np.ndarray, known: Mapping[str, float] | None = None
) -> tuple[Body, list[Input]]:
    """The body at which the search begins, and inputs for moments that were not stated.

    Unknowns without a start get their value in `known`, else the one with which all vertical frequencies equal the
    mean of the measured ones.
    """
    b = given.body
    square = float(np.mean(frequency)) ** 2
    arm = stand.points - stand.points.mean(axis=0)

    def value(given_value: Uncertain | None, guess: float) -> float:
        return guess if given_value is None or np.isnan(given_value.value) else given_value.value

    arms = {"Ixx": arm[:, 2], "Izz": arm[:, 0]}
    guess = {k: float((stand.stiffness * r**2).sum()) / square for k, r in arms.items()}
    guess |= {"mass": float(stand.stiffness.sum()) / square, **{k: v for k, v in (known or {}).items() if k in guess}}
    mass = value(b.mass, guess["mass"])
    moments = {k: value(getattr(b, k), guess[k]) for k in ("Ixx", "Izz")}
    moments["Iyy"] = value(b.Iyy, max(moments.values()))
    if known is None:
        _make_possible(moments, [k for k in moments if (v := getattr(b, k)) is None or np.isnan(v.value)])
    Ixx, Iyy, Izz = moments["Ixx"], moments["Iyy"], moments["Izz"]
    products = [value(v, 0.0) for v in (b.Ixy, b.Ixz, b.Iyz)]
    tensor = np.array([[Ixx, *products[:2]], [products[0], Iyy, products[2]], [products[1], products[2], Izz]])
    centre = (value(b.offset_x, 0.0), -value(b.height, 0.0), value(b.offset_z, 0.0))
    # any body's Iyy lies between the difference and the sum of the others
    assumed = []
    if b.Iyy is None:
        assumed.append(Input(("Iyy",), "body.Iyy", Iyy, 2.0 * min(Ixx, Izz) / np.sqrt(12.0), "kg m²"))
    if reason := inertia_defect(tensor):
        moments_told = ", ".join(f"{k} = {v:.6g}" for k, v in sorted(moments.items()))
        raise InputError(
            f"body: the search would begin at an inertia ({moments_told} kg m2 with the products stated) that no body "
            f"has: {reason}; correct them, or give unknowns a start, such as Ixx: unknown near 3700 kg m^2"
        )
    return Body(mass=mass, centre=centre, inertia=tensor), assumed


def _make_possible(moments: dict[str, float], guessed: Sequence[str]) -> None:
    """Move guessed moments so that each lies between the difference and the sum of the others."""
    for _ in range(3):
        for key in guessed:
            one, other = (moments[k] for k in moments if k != key)
            moments[key] = float(np.clip(moments[key], 1.01 * abs(one - other), 0.99 * (one + other)))


def sensors_of(given: OnSprings, stand: Stand) -> tuple[np.ndarray, np.ndarray]:
    """Points (c, 3) and directions (c, 3) of the sensors."""
    points, directions = [], []
    for sensor in given.signals.sensors:
        at: Any = sensor.point
        points.append(stand.points[at - 1] if isinstance(at, int) else np.array([v.value for v in at]))
        way = np.array(DIRECTIONS[sensor.direction] if isinstance(sensor.direction, str) else sensor.direction)
        directions.append(way / np.linalg.norm(way))
    return np.array(points), np.array(directions)


def inputs_of(given: OnSprings, modal: Modal) -> list[Input]:
    """All known numbers with an uncertainty."""
    s, b, found = given.stand, given.body, []

    def add(target: tuple[Any, ...], key: str, value: Uncertain | None, unit: str) -> None:
        if value is not None and value.std > 0.0 and not value.unknown:
            found.append(Input(target, key, value.value, value.std, unit))

    for key, name in PROPERTIES.items():
        add((name,), f"body.{key}", getattr(b, key), LABELS[key][1])
    add(("gravity",), "stand.gravity", s.gravity, "m/s²")
    add(("a",), "stand.half_length", s.half_length, "m")
    add(("b",), "stand.half_width", s.half_width, "m")
    add(("factor",), "stand.common_factor", s.common_factor, "1")
    for i, point in enumerate(s.points or ()):
        for axis, value in enumerate(point):
            add(("point", i, axis), f"stand.points.{i}.{'xyz'[axis]}", value, "m")
    for field, key, unit in (
        ("stiffness", "stiffness", "N/m"),
        ("length", "natural_length", "m"),
        ("lateral_stiffness", "lateral_stiffness", "N/m"),
    ):
        values = getattr(s, key)
        for i in range(s.number):
            add((field, i), f"stand.{key} {i + 1}", values[i if len(values) > 1 else 0], unit)
    for c, sensor in enumerate(given.signals.sensors):
        if isinstance(sensor.point, tuple):
            for axis, value in enumerate(sensor.point):
                add(("sensor", c, axis), f"signals.sensors.{c}.point.{'xyz'[axis]}", value, "m")
    for c, std in enumerate(modal.reading.sensitivity_std):
        add(("sensitivity", c), f"signals.sensors.{c}.sensitivity, relative", Uncertain(1.0, float(std)), "1")
    add(("clock",), "signals.clock", given.signals.clock, "1")
    for number, tare in enumerate(given.tare):
        for key, name in PROPERTIES.items():
            add((f"tare{number + 1}_{name}",), f"tare.{number}.{key}", getattr(tare, key), LABELS[key][1])
    if given.mounting is not None and given.mounting.body:
        for along, place in zip("xyz", given.mounting.position, strict=True):
            add((f"position_{along}",), f"mounting.position.{along}", place, "m")
            turn = Uncertain(0.0, given.mounting.alignment)
            add((f"turn_{along}",), f"mounting.alignment about {along}", turn, "rad")
    if given.air is not None:
        add(("air_density",), "air.density", given.air.density, "kg/m³")
        for number, shape in enumerate(given.air.shapes):
            add((f"air_factor{number + 1}",), f"air.shapes.{number}.factor", shape.factor, "1")
    return found


def assumptions(given: OnSprings, body: Body, extra: list[Input], half: float) -> tuple[tuple[str, str], ...]:
    """What was taken as known, with its uncertainty or as exact, for the certificate."""
    rows = []
    for key in PROPERTIES:
        value = getattr(given.body, key)
        label, unit = LABELS[key]
        if value is None:
            stated = [i for i in extra if i.key == f"body.{key}"]
            text = (
                f"{shown(stated[0].value, stated[0].std)} {unit}, anything that a body can have"
                if stated
                else (f"0 {unit}, taken as exact: not stated")
            )
            rows.append((label, text))
        elif not value.unknown:
            exact = "" if value.std else ", taken as exact"
            rows.append((label, f"{shown(value.value, value.std)} {unit}{exact}"))
    s = given.stand
    sides = {k: v for k in ("half_length", "half_width") if (v := getattr(s, k)) is not None}
    fixed = [k for k, v in sides.items() if not v.std and not v.unknown]
    fixed += [k for k in ("stiffness", "natural_length", "lateral_stiffness") if not any(v.std for v in getattr(s, k))]
    fixed += ["points"] if s.points is not None and not any(c.std for p in s.points for c in p) else []
    if fixed:
        rows.append(("of the stand, taken as exact", ", ".join(k.replace("_", " ") for k in fixed)))
    held = "held sideways and in yaw" if s.support == "guided" else "free in six degrees of freedom"
    rows.append(("support", f"{s.support}: {held}"))
    if any(np.isnan(getattr(given.body, k).value) for k in ("mass", "Ixx", "Izz")):
        rows.append(("sampling", f"no mode of the body lies above half the sampling rate, {half:.6g} rad/s"))
    if any(v.value for v in (*s.damping, *s.lateral_damping)):
        rows.append(("damping of the springs", "as stated it is not used: the decay is measured with the frequencies"))
    rows.append(("body and sensors", "rigid; small motion about the equilibrium; springs linear and without mass"))
    return tuple(rows)
