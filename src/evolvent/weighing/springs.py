"""A body on springs: from modes to its mass, centre of mass and inertia, with all that these depend on."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from evolvent.errors import InputError
from evolvent.inertia import Body, Candidate, Inertia, Stand, candidates, fit, linear_model, mac
from evolvent.inertia.problem import Problem, assign, matching, undetermined
from evolvent.inertia.stand import broken
from evolvent.weighing import amplitude, choice
from evolvent.weighing.description import DIRECTIONS, PROPERTIES, OnSprings
from evolvent.weighing.found import Evaluation, Output, Share
from evolvent.weighing.modal import Modal, refuse_fast, refuse_rate
from evolvent.weighing.uncertain import Uncertain

#: Agreement of measured and model shapes below which nothing is certified, and below which it is told.
LEAST_MAC, GOOD_MAC = 0.8, 0.98
#: A misfit above it is told; the data's deviations are widened by any misfit above 1.
TOLD_MISFIT = 3.0
_CHECK = (
    "check which column is which sensor, their points, directions and signs, or leave the mode out by "
    "identification.band"
)
LABELS = {
    "mass": ("mass", "kg"),
    "offset_x": ("centre of mass, x offset", "m"),
    "height": ("height of the attachment plane above the centre of mass", "m"),
    "offset_z": ("centre of mass, z offset", "m"),
    **{f"I{a}{a}": (f"moment of inertia about {a}", "kg m²") for a in "xyz"},
    **{f"I{ab}": (f"product of inertia {ab} (element of the tensor)", "kg m²") for ab in ("xy", "xz", "yz")},
    "common_factor": ("common factor on the stiffnesses", "1"),
}


#: Modes above half the sampling rate are thought of up to so many times the heave, in at most so many ways.
HIGHEST, MOST_FOLDED = 4.0, 10
#: A second-order part of the standard uncertainty above this is told.
BENT = 0.1
#: A shift by the amplitude above this share of the standard uncertainty is told.
TOLD_SHIFT = 0.3
#: Contributions below this share of an output's size are rounding of the arithmetic.
ROUNDING = 1e-13


class Input(NamedTuple):
    """A known number that is uncertain: what `shifted` changes, its key for the user, value, std, unit."""

    target: tuple[Any, ...]
    key: str
    value: float
    std: float
    unit: str


class Task(NamedTuple):
    """What is to be solved: a description, the modes used of those found, and what stays while the body is sought.

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


class Case(NamedTuple):
    """A problem with the values of the common factor's base."""

    problem: Problem
    sensors: np.ndarray
    directions: np.ndarray
    keys: tuple[str, ...]
    mean: float


def evaluate(given: OnSprings, modal: Modal, own: Sequence[str] = ()) -> Evaluation:
    """Mass properties from the modes of one recording.

    Raises
    ------
    InputError
        Springs that cannot hold the body, a rate too low for its modes, unknowns that the data cannot tell, shapes
        that no motion of the body has, an inertia that no body has.
    """
    stand = _stand(given)
    used, why, warnings = choice.chosen(given, modal)
    if np.isfinite(given.body.mass.value):
        heave = float(np.sqrt(stand.stiffness.sum() / given.body.mass.value))
        refuse_rate(heave, modal.reading.rate, "the body's heave")
        refuse_fast(heave, modal.frequency[list(used)])
    body, _ = _body(given, stand, modal.frequency[list(used)])
    _expected(given, stand, body, modal)
    sensors, directions = _sensors(given, stand)
    used, merged = choice.apart(linear_model(stand, body).modes(), modal, used, sensors, directions)
    amplitude.refuse(stand.length, modal)
    _rigid(modal, used, sensors, directions)
    keys = (*given.body.unknown, *(("common_factor",) if given.stand.common_factor.unknown else ()))
    mean = float(np.mean(stand.stiffness))
    if not used:
        raise InputError("; ".join(merged))
    few = "; ".join(merged) or choice.few(given, modal, used, sensors, directions)
    if not given.identification.shapes:
        _ambiguous(given, stand, body, modal, used)
    task = Task(given, modal, used, stand, sensors, directions, keys, mean)
    try:
        case, inertia, body, start_assumed = _solve(task)
        values = np.array([inertia.values[name] for name in case.problem.unknown])
        badly: list[str] = []
        model_frequency, agreement, model_shapes = _compare(case, values, modal, used, badly)
    except InputError as error:
        hints = [hint for hint in (few, amplitude.large(stand.length, modal)) if hint]
        raise InputError("; ".join([str(error), *hints])) from None
    warnings += [few] if few else []
    warnings += [w for w in inertia.warnings if not w.startswith("the model misses")]
    warnings += badly
    inputs = [*_inputs(given, modal), *start_assumed]
    shares, covariance, consistency, widened, P, bent = _budget(case, values, inputs, own, modal.certain)
    if np.isfinite(consistency) and consistency > TOLD_MISFIT:
        warnings.append(
            f"the model misses the data by {consistency:.1f} of the deviations that hold for all inputs; the data's "
            "part of the uncertainty is widened by it"
        )
    bias = _amplitude(case, values, modal, used, P)
    if bias is not None:
        share, told = bias
        shares, covariance = (*shares, share), covariance + np.outer(share.contribution, share.contribution)
        warnings += told(np.sqrt(np.diag(covariance)))
    warnings += _folded(task, inertia, consistency)
    draws = None
    if given.uncertainty.method == "gum":
        warnings += bent
    else:
        draws = _monte_carlo(case, values, inputs, given, widened, P)
        if bias is not None:
            random = np.random.default_rng(given.uncertainty.seed + 1)
            draws = draws + random.standard_normal((len(draws), 1)) * bias[0].contribution
        covariance = np.atleast_2d(np.cov(draws, rowvar=False))
    scale = np.array([1.0 / mean if k == "common_factor" else 1.0 for k in keys])
    if draws is not None:
        draws = draws * scale
    shares = tuple(s._replace(contribution=s.contribution * scale) for s in shares)
    return Evaluation(
        modal=modal,
        used=used,
        outputs=tuple(Output(k, *LABELS[k]) for k in keys),
        values=values * scale,
        covariance=covariance * np.outer(scale, scale),
        shares=shares,
        why=(*why, _how(inertia, case)),
        assumed=_assumed(given, body, start_assumed, np.pi * modal.reading.rate),
        cannot=_cannot(case, values, given),
        model_frequency=model_frequency,
        agreement=agreement,
        model_shapes=model_shapes,
        consistency=consistency,
        candidates=_others(task, inertia),
        draws=draws,
        warnings=tuple(warnings),
    )


# ------------------------------------------------------------------------------------------------ what is known


def _each(values: tuple[Uncertain, ...], n: int) -> np.ndarray:
    return np.broadcast_to(np.array([v.value for v in values]), (n,)).copy()


def _stand(given: OnSprings) -> Stand:
    s, n = given.stand, given.stand.number
    return Stand(
        points=s.places,
        stiffness=_each(s.stiffness, n) * stand_factor(given),
        length=_each(s.natural_length, n),
        damping=_each(s.damping, n),
        lateral_stiffness=_each(s.lateral_stiffness, n),
        lateral_damping=_each(s.lateral_damping, n),
        support=s.support,
        gravity=s.gravity.value,
    )


def _body(
    given: OnSprings, stand: Stand, frequency: np.ndarray, known: Mapping[str, float] | None = None
) -> tuple[Body, list[Input]]:
    """Where the search begins, and inputs of numbers that nobody stated.

    Unknowns without a start get what is `known` of them by now, else what makes all vertical frequencies alike, at the
    measured ones' mean.
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
    if reason := broken(tensor):
        moments_told = ", ".join(f"{k} = {v:.6g}" for k, v in sorted(moments.items()))
        raise InputError(
            f"body: the search would begin at an inertia ({moments_told} kg m2 with the products stated) that no body "
            f"has: {reason}; correct them, or give unknowns a start, such as Ixx: unknown near 3700 kg m^2"
        )
    return Body(mass=mass, centre=centre, inertia=tensor), assumed


def _make_possible(moments: dict[str, float], guessed: Sequence[str]) -> None:
    """Move guessed moments to where each is between the difference and the sum of the others."""
    for _ in range(3):
        for key in guessed:
            one, other = (moments[k] for k in moments if k != key)
            moments[key] = float(np.clip(moments[key], 1.01 * abs(one - other), 0.99 * (one + other)))


def _sensors(given: OnSprings, stand: Stand) -> tuple[np.ndarray, np.ndarray]:
    """Points (c, 3) and directions (c, 3) of the sensors."""
    points, directions = [], []
    for sensor in given.signals.sensors:
        at: Any = sensor.point
        points.append(stand.points[at - 1] if isinstance(at, int) else np.array([v.value for v in at]))
        way = np.array(DIRECTIONS[sensor.direction] if isinstance(sensor.direction, str) else sensor.direction)
        directions.append(way / np.linalg.norm(way))
    return np.array(points), np.array(directions)


def _inputs(given: OnSprings, modal: Modal) -> list[Input]:
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
    return found


def _assumed(given: OnSprings, body: Body, extra: list[Input], half: float) -> tuple[tuple[str, str], ...]:
    """What entered as known: with its uncertainty, or exact."""
    from evolvent.weighing.numbers import shown

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
    fixed = [k for k in ("half_length", "half_width") if (v := getattr(s, k)) is not None and not v.std]
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
    rows.append(("body and sensors", "rigid; small motion about the rest; springs linear and without mass"))
    return tuple(rows)


# ------------------------------------------------------------------------------------------------ solution


def _expected(given: OnSprings, stand: Stand, body: Body, modal: Modal) -> None:
    """Refuse a stand that cannot hold the body, and a rate too low for modes that are known beforehand."""
    found = linear_model(stand, body).modes()  # refuses
    b = given.body
    if all(np.isfinite(v.value) for v in (b.mass, b.Ixx, b.Izz)):
        vertical = np.abs(found.at(stand.points)).max(axis=-1)
        seen = found.natural_frequency[vertical > 1e-3 * vertical.max()]
        refuse_rate(float(seen.max()), modal.reading.rate, "the body's highest mode")


def _solve(task: Task) -> tuple[Case, Inertia, Body, list[Input]]:
    """What was solved, its solution, where the search began, and inputs that nobody stated."""
    frequency = task.modal.frequency[list(task.used)]
    body, assumed = _body(task.given, task.stand, frequency)
    case, inertia = _fit(task, body)
    if assumed:  # Iyy follows the moments found
        body, assumed = _body(task.given, task.stand, frequency, inertia.values)
        case, inertia = _fit(task, body)
    return case, inertia, body, assumed


def _fit(task: Task, body: Body) -> tuple[Case, Inertia]:
    given, modal, keys = task.given, task.modal, task.keys
    rows = list(task.used)
    unknown = [PROPERTIES.get(k, "stiffness") for k in keys]
    prior = {}
    for key, name in zip(keys, unknown, strict=True):
        stated = given.stand.common_factor if key == "common_factor" else getattr(given.body, key)
        if stated.std > 0.0:
            scale = task.mean / stand_factor(given) if key == "common_factor" else 1.0
            prior[name] = (stated.value * scale, stated.std * scale)
    shapes: dict[str, Any] = {}
    if given.identification.shapes:
        shapes = {"shapes": modal.shapes[rows], "points": task.sensors, "directions": task.directions}
        if modal.certain:
            shapes["shape_covariance"] = modal.shape_covariance[rows]
    inertia = fit(
        task.stand,
        body,
        unknown,
        modal.frequency[rows],
        frequency_covariance=modal.frequency_covariance[np.ix_(rows, rows)] if modal.certain else None,
        model=given.identification.model,
        prior=prior,
        **shapes,
    )
    return Case(inertia.problem, task.sensors, task.directions, keys, task.mean), inertia


def _folded(task: Task, inertia: Inertia, consistency: float) -> list[str]:
    """Warn of other bodies with modes above half the sampling rate, whose samples would look the same.

    Notes
    -----
    Samples at the rate f do not tell w from 2 pi f n +- w. Tried are the partners up to `HIGHEST` times the heave,
    unless the stated starts are nearer to the body found.
    """
    given, modal, used, stand = task.given, task.modal, task.used, task.stand
    turn = 2.0 * np.pi * modal.reading.rate
    limit = HIGHEST * float(np.sqrt(stand.stiffness.sum() / inertia.values["mass"]))
    times = range(1, int(limit / turn) + 2)
    ways = [
        [w, *(x for n in times for x in (n * turn - w, n * turn + w) if x < limit)] for w in modal.frequency[list(used)]
    ]
    tried = sorted(itertools.product(*ways), key=lambda way: sum(w > 0.5 * turn for w in way))[1 : MOST_FOLDED + 1]
    told = []
    for way in tried:
        frequency = modal.frequency.copy()
        frequency[list(used)] = way
        other = dataclasses.replace(modal, frequency=frequency)
        try:
            case, found, _, extra = _solve(task._replace(modal=other))
            values = np.array([found.values[name] for name in case.problem.unknown])
            _compare(case, values, other, used, [])
            agreement = _budget(case, values, [*_inputs(given, modal), *extra], (), modal.certain)[2]
        except InputError:
            continue
        if agreement > max(TOLD_MISFIT, 1.5 * consistency) or _off(given, found) > _off(given, inertia):
            continue
        moved = ", ".join(
            f"{w:.6g} for {v:.6g} rad/s" for w, v in zip(way, (x[0] for x in ways), strict=True) if w != v
        )
        values_told = ", ".join(
            f"{k} = {found.values[n]:.6g} {LABELS[k][1]}" for k, n in PROPERTIES.items() if n in case.problem.unknown
        )
        told.append(f"{moved}: {values_told}")
        if agreement < 0.5 * consistency and consistency > TOLD_MISFIT:
            raise InputError(
                f"sampled at {modal.reading.rate:.6g} Hz, the modes fit better as faster ones ({told[-1]}); state this "
                "with a start, such as Ixx: unknown near 3700 kg m^2, or sample faster"
            )
    if not told:
        return []
    return [
        f"sampled at {modal.reading.rate:.6g} Hz, faster modes look the same and fit as well ({'; '.join(told[:3])}); "
        "give the unknowns a start, such as Ixx: unknown near 3700 kg m^2, or sample faster"
    ]


def _off(given: OnSprings, found: Inertia) -> float:
    """How far a body is from where the unknowns were said to be, in logarithms; 0 where nothing was said."""
    starts = {n: getattr(given.body, n) for n in ("mass", "Ixx", "Iyy", "Izz")}
    known = {n: v.value for n, v in starts.items() if v is not None and v.unknown and v.value > 0.0}
    return round(sum(abs(float(np.log(found.values[n] / v))) for n, v in known.items()), 3)


def stand_factor(given: OnSprings) -> float:
    """The common factor that the stand was set up with."""
    value = given.stand.common_factor.value
    return value if np.isfinite(value) else 1.0


def _how(inertia: Inertia, case: Case) -> str:
    with_shapes = "frequencies and mode shapes" if case.problem.shapes is not None else "frequencies"
    model = "six degrees of freedom about the true rest" if case.problem.model == "full" else "three of a level body"
    return (
        f"Least squares of {with_shapes}, weighted by their covariances, on the linear model with {model}; begun at "
        "the best of the stated body and of the direct solutions from the modes."
    )


def _ambiguous(given: OnSprings, stand: Stand, body: Body, modal: Modal, used: tuple[int, ...]) -> None:
    """Refuse three frequencies alone where nothing says which of several bodies it is."""
    b = given.body
    asked = [b.Ixx, b.Izz]
    if len(used) != 3 or not all(v.unknown for v in asked) or any(np.isfinite(v.value) for v in asked):
        return
    found = candidates(stand, body, modal.frequency[list(used)])
    if len(found) > 1:
        pairs = "; ".join(f"{c.Ixx:.6g} and {c.Izz:.6g} with springs of {c.stiffness:.6g} N/m" for c in found)
        raise InputError(
            f"{len(found)} pairs of Ixx and Izz give these frequencies ({pairs}); leave identification.shapes on, or "
            "give a start, such as Ixx: unknown near 3700 kg m^2"
        )


def _rigid(modal: Modal, used: tuple[int, ...], sensors: np.ndarray, directions: np.ndarray) -> None:
    """Refuse shapes that no motion of a rigid body has, whatever its mass."""
    motions = np.concatenate([directions, np.cross(sensors, directions)], axis=1)
    U, sigma, _ = np.linalg.svd(motions, full_matrices=False)
    U = U[:, sigma > 1e-6 * sigma[0]]
    for k in used:
        shape = modal.shapes[k]
        share = float(np.sum((U.T @ shape) ** 2) / np.sum(shape**2))
        if share < LEAST_MAC:
            raise InputError(
                f"the shape of mode {k + 1} ({modal.frequency[k]:.6g} rad/s) is no motion of a rigid body: only "
                f"{share:.0%} of it is; {_CHECK}"
            )


def _compare(
    case: Case, values: np.ndarray, modal: Modal, used: tuple[int, ...], warnings: list[str]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Model frequencies, agreement of shapes, and model shapes scaled to the measured ones."""
    p = case.problem
    found = p.linear(assign(p.base, p.unknown, values)).modes()
    w, v = np.sqrt(found.eigenvalue), found.at(case.sensors, case.directions)
    frequency, shapes = modal.frequency[list(used)], modal.shapes[list(used)]
    agreement = np.nan_to_num(mac(shapes[:, None], v[None]))
    pick = matching(np.abs(np.log(w[None] / frequency[:, None])) + (1.0 - agreement))
    v, agreement = v[pick], agreement[np.arange(len(pick)), pick]
    v = v * (np.sum(v * shapes, axis=1) / np.maximum(np.sum(v * v, axis=1), 1e-300))[:, None]
    for k, (number, value) in enumerate(zip(used, agreement, strict=True)):
        told = (
            f"the shape of mode {number + 1} ({frequency[k]:.6g} rad/s) agrees with no motion of the body on this "
            f"stand (MAC {value:.2f})"
        )
        if value < LEAST_MAC and len(case.sensors) > 1:
            raise InputError(f"{told}; {_CHECK}")
        if value < GOOD_MAC and len(case.sensors) > 1:
            warnings.append(told.replace("agrees with no", "agrees badly with any"))
    return w[pick], agreement, v


def _others(task: Task, inertia: Inertia) -> tuple[Candidate, ...]:
    """All pairs of moments that the three frequencies alone allow, for the certificate."""
    modal, used, sensors = task.modal, task.used, task.sensors
    vertical = np.all(task.directions == DIRECTIONS["vertical"])
    if len(used) != 3 or not vertical:
        return ()
    body = Body(mass=inertia.values["mass"], centre=inertia.centre, inertia=inertia.tensor)
    try:
        return candidates(
            task.stand, body, modal.frequency[list(used)], shapes=modal.shapes[list(used)], points=sensors
        )
    except InputError:
        return ()


def _cannot(case: Case, values: np.ndarray, given: OnSprings) -> tuple[tuple[str, str], ...]:
    """For each property that was not asked: whether these data could have told it as well."""
    p, rows = case.problem, []
    for key, name in (*PROPERTIES.items(), ("common_factor", "stiffness")):
        if name in p.unknown:
            continue
        more = dataclasses.replace(p, base=assign(p.base, p.unknown, values), unknown=(*p.unknown, name))
        told = undetermined(more.jacobian(more.start), more.unknown, more.scale)
        if told:
            rows.append((LABELS[key][0], "; ".join(told).replace("stiffness", "the springs' stiffness")))
    return tuple(rows)


# ------------------------------------------------------------------------------------------------ uncertainty


def shifted(p: Problem, inputs: Sequence[Input], shifts: np.ndarray) -> tuple[Problem, np.ndarray, np.ndarray | None]:
    """The problem, frequencies and shapes with inputs changed: one row of `shifts` (n, q) a case."""
    n = len(shifts)
    s = p.base
    springs = s.points.shape[-2]
    own: dict[str, Any] = {
        "points": np.broadcast_to(s.points, (n, springs, 3)).copy(),
        "ground": np.broadcast_to(s.ground, (n, springs, 3)).copy(),
        **{
            f: np.broadcast_to(getattr(s, f), (n, springs)).copy() for f in ("stiffness", "length", "lateral_stiffness")
        },
    }
    named: dict[str, np.ndarray] = {}
    frequency = np.broadcast_to(p.frequency, (n, len(p.frequency))).copy()
    shapes = None if p.shapes is None else np.broadcast_to(p.shapes, (n, *p.shapes.shape)).copy()
    sensors = None if p.points is None else np.broadcast_to(p.points, (n, *p.points.shape)).copy()
    factor = np.ones(n)
    for item, d in zip(inputs, shifts.T, strict=True):
        match item.target:
            case ("clock",):
                frequency /= (1.0 + d / item.value)[:, None]
            case ("sensitivity", c) if shapes is not None:
                shapes[..., c] /= (1.0 + d)[:, None]
            case ("sensor", c, axis) if sensors is not None:
                sensors[:, c, axis] += d
            case ("factor",):
                factor = 1.0 + d / item.value
            case ("a" | "b" as side,):
                axis = 0 if side == "a" else 2
                moved = own["points"][..., axis] * (d / item.value)[:, None]
                own["points"][..., axis] += moved
                own["ground"][..., axis] += moved
            case ("point", i, axis):
                own["points"][:, i, axis] += d
                own["ground"][:, i, axis] += d
            case ("length", i):
                up = np.sign(s.ground[i, 1] - s.points[i, 1])
                own["length"][:, i] += d
                own["ground"][:, i, 1] += up * d
            case ("stiffness" | "lateral_stiffness" as field, i):
                own[field][:, i] += d
            case (str() as name,):
                named[name] = item.value + d
    own["stiffness"] *= factor[:, None]
    own["lateral_stiffness"] = np.maximum(own["lateral_stiffness"], 0.0)
    base = s._replace(**own)
    if named:
        base = assign(base, tuple(named), np.stack(list(named.values()), axis=-1))
    return dataclasses.replace(p, base=base, points=sensors), frequency, shapes


def _residual(
    p: Problem, values: np.ndarray, inputs: Sequence[Input], shifts: np.ndarray, noise: tuple[Any, Any] = (0.0, 0.0)
) -> np.ndarray:
    moved, frequency, shapes = shifted(p, inputs, shifts)
    frequency = frequency + noise[0]
    shapes = None if shapes is None else shapes + noise[1]
    values = np.broadcast_to(values, (len(shifts), values.shape[-1]))
    return moved.residual(values, (), None, frequency, shapes)


def _ends(p: Problem, values: np.ndarray, inputs: Sequence[Input], share: float) -> tuple[np.ndarray, np.ndarray]:
    """Shifts (2 q, q) of each input up and down by a share of its deviation, and the residuals there.

    Raises
    ------
    InputError
        Where no stand or body can have the input so far off; it names the input.
    """
    steps = np.diag([share * i.std for i in inputs])
    shifts = np.concatenate([steps, -steps])
    with np.errstate(all="ignore"):
        try:
            r = _residual(p, values, inputs, shifts)
            if np.all(np.isfinite(r)):
                return shifts, r
        except (InputError, np.linalg.LinAlgError):
            pass
        for k, shift in enumerate(shifts):
            item = inputs[k % len(inputs)]
            reason = "the model has no modes"
            try:
                if np.all(np.isfinite(_residual(p, values, inputs, shift[None]))):
                    continue
            except InputError as error:
                reason = str(error)
            except np.linalg.LinAlgError:
                pass
            raise InputError(
                f"the standard uncertainty of {item.key}, {item.std:.3g} {item.unit}, leads to what cannot be "
                f"evaluated, at {item.value + shift[k % len(inputs)]:.6g} {item.unit}: {reason}"
            )
    raise InputError("the uncertainties lead to what cannot be evaluated; state smaller ones")


def _bent(p: Problem, values: np.ndarray, inputs: Sequence[Input], P: np.ndarray) -> np.ndarray:
    """(q, p) f'' u^2 / sqrt(2) of each output f for each input, from evaluations one deviation up and down.

    Notes
    -----
    GUM (2008), 5.1.2, note: of a quadratic input f'' du^2 / 2 the variance is f''^2 u^4 / 2. Products of different
    inputs are left out.
    """
    if not inputs:
        return np.zeros((0, len(values)))
    shifts, _ = _ends(p, values, inputs, 1.0)
    shifts = np.concatenate([shifts, np.zeros((1, len(inputs)))])
    found = np.broadcast_to(values, (len(shifts), len(values)))
    with np.errstate(all="ignore"):
        for _ in range(4):
            try:
                found = found - _residual(p, found, inputs, shifts) @ P.T
            except (InputError, np.linalg.LinAlgError):
                found = np.full_like(found, np.nan)
    q = len(inputs)
    return np.asarray((found[:q] + found[q:-1] - 2.0 * found[-1]) / np.sqrt(2.0))


def _budget(
    case: Case, values: np.ndarray, inputs: Sequence[Input], own: Sequence[str], certain: bool
) -> tuple[tuple[Share, ...], np.ndarray, float, float, np.ndarray, list[str]]:
    """Shares, covariance, consistency, the factor on the data's deviations, dp = -P dr, and what is not linear.

    Notes
    -----
    GUM (2008), eq. 10 and 13, at the least squares: an input shifts the unknowns by -J^+ (dr/dx) dx. The residual r
    should have the covariance 1 + D D^T, D = dr/dx u(x); what is left of it off the columns of J is held against that,
    and where it is larger the data's deviations are widened by the root of the mean square (Birge 1932).
    """
    p = case.problem
    scale = p.scale
    J = p.jacobian(values) * scale
    P = scale[:, None] * np.linalg.pinv(J)
    D = np.zeros((len(J), 0))
    if inputs:
        plus, minus = np.split(_ends(p, values, inputs, 0.5)[1], 2)
        D = (plus - minus).T
    r = p.residual(values)
    free = len(r) - len(values) - (0 if p.shapes is None else len(p.shapes))
    consistency = np.nan
    if free > 0 and certain:
        U, sigma, _ = np.linalg.svd(J)
        N = U[:, np.count_nonzero(sigma > 1e-12 * sigma[0]) :]
        z, E = N.T @ r, N.T @ D
        consistency = float(np.sqrt(z @ np.linalg.solve(np.eye(len(z)) + E @ E.T, z) / free))
    widened = max(1.0, consistency) if np.isfinite(consistency) else 1.0
    m = len(p.frequency)
    last = len(r) - len(p.prior)
    first, second = -(P @ D).T, np.nan_to_num(_bent(p, values, inputs, P), posinf=0.0, neginf=0.0)
    sign = np.sign(np.where(np.abs(first) >= np.abs(second), first, second))
    given = sign * np.hypot(first, second)
    given[np.abs(given) < ROUNDING * scale] = 0.0
    shares = [
        Share(i.key, i.unit, i.value, i.std, given[k], i.key in own or any(i.key.startswith(o) for o in own))
        for k, i in enumerate(inputs)
    ]
    groups = []
    if certain:
        groups = [("noise: frequencies", P[:, :m], widened), ("noise: mode shapes", P[:, m:last], widened)]
    groups += [("other measurements of the unknowns", P[:, last:], 1.0)]
    covariance = given.T @ given
    for label, part, factor in groups:
        if part.shape[1]:
            covariance = covariance + factor**2 * part @ part.T
            contribution = factor * np.sqrt(np.sum(part**2, axis=1))
            contribution[contribution < ROUNDING * scale] = 0.0
            shares.append(Share(label, "", np.nan, np.nan, contribution, label.startswith("noise")))
    std = np.sqrt(np.diag(covariance))
    bent = [
        f"{i.key} with +- {i.std:.3g} {i.unit} does not act on {' and '.join(name for name in acted)} in proportion; "
        "the second order is in u, but for the coverage interval take uncertainty.method=monte-carlo"
        for k, i in enumerate(inputs)
        if (acted := [n for j, n in enumerate(case.keys) if abs(second[k, j]) > BENT * std[j]])
    ]
    return tuple(shares), covariance, consistency, widened, P, bent


def _amplitude(
    case: Case, values: np.ndarray, modal: Modal, used: tuple[int, ...], P: np.ndarray
) -> tuple[Share, Callable[[np.ndarray], list[str]]] | None:
    """What the amplitude of the swing shifts, as a share of the budget, and its warnings for given deviations."""
    p = case.problem
    found = amplitude.shift(assign(p.base, p.unknown, values), modal, used, case.sensors, case.directions)
    if found is None:
        return None
    told = f"the springs' ends move by {1e3 * found.largest:.3g} mm, so that their stiffness is not quite linear"
    lost = not np.all(np.isfinite(found.frequency))
    step = (
        np.zeros(len(values))
        if lost
        else P @ (p.residual(values, frequency=p.frequency - found.frequency) - p.residual(values))
    )
    keys = case.keys

    def warnings(std: np.ndarray) -> list[str]:
        if lost:
            return [f"{told}; what this does to the result cannot be estimated, and is not in u; let it swing less"]
        shown = [
            f"{k} by about {x:.2g} {LABELS[k][1]}"
            for k, x, u in zip(keys, step, std, strict=True)
            if abs(x) > TOLD_SHIFT * u
        ]
        return [f"{told}: this shifts {' and '.join(shown)}, which is in u; let it swing less"] if shown else []

    return Share("amplitude of the swing", "", np.nan, np.nan, step), warnings


def _monte_carlo(
    case: Case, values: np.ndarray, inputs: Sequence[Input], given: OnSprings, widened: float, P: np.ndarray
) -> np.ndarray:
    """(n, p) unknowns identified anew from drawn inputs and data (GUM Supplement 1); Gauss-Newton with a fixed P."""
    p, n = case.problem, given.uncertainty.draws
    random = np.random.default_rng(given.uncertainty.seed)
    shifts = random.standard_normal((n, len(inputs))) * np.array([i.std for i in inputs])
    L = widened * np.linalg.cholesky(p.frequency_covariance)
    noise: list[Any] = [random.standard_normal((n, len(L))) @ L.T, 0.0]
    if p.shapes is not None and p.shape_covariance is not None:
        L = widened * np.linalg.cholesky(p.shape_covariance)
        noise[1] = np.einsum("mij,nmj->nmi", L, random.standard_normal((n, *p.shapes.shape)))
    other = random.standard_normal((n, len(p.prior)))
    found = np.broadcast_to(values, (n, len(values)))
    for _ in range(6):
        try:
            r = _residual(p, found, inputs, shifts, (noise[0], noise[1]))
        except (InputError, np.linalg.LinAlgError) as error:
            widest = max(inputs, key=lambda i: i.std / abs(i.value) if i.value else 0.0)
            raise InputError(
                f"the Monte Carlo draws inputs that no stand or body can have ({error}); the widest is {widest.key}, "
                f"{widest.value:.6g} +- {widest.std:.3g} {widest.unit}"
            ) from None
        if p.prior:
            r[..., -len(p.prior) :] -= other
        found = found - r @ P.T
    if not np.all(np.isfinite(found)):
        raise InputError("the Monte Carlo leaves what the stand can hold; the uncertainties are too large for it")
    return np.asarray(found)
