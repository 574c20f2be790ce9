"""Coverage of the truth: how often the stated uncertainty of mass properties holds it, for each stand and disturbance.

    python benchmarks/coverage_of_truth.py [-o docs/coverage.json] [--repetitions 200] [--stands torsion] [--only drag]

Rows are put into the file beside those that it holds. The page docs/coverage.md is written from it.

Motions are simulated by equations of their own (tests/massprops/motions.py of its package), with bodies, amplitudes,
phases, damping, rates and disturbances drawn again for each repetition, and evaluated as a user would: signals and a
description. All inputs of the stand are exact, so that u is that of the signals alone. Counted are repetitions that
are refused, those whose truth lies within 2 u, those with a warning that names the cause, and those with neither:
silent misses.
"""

from __future__ import annotations

import argparse
import json
import pathlib
import re
import sys
import time as clock
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "packages" / "evolvent-massprops" / "tests"))

from evolvent_base.errors import InputError  # noqa: E402
from evolvent_base.signals import Signals  # noqa: E402
from evolvent_massprops import mass_properties  # noqa: E402
from massprops import motions  # noqa: E402

Array = np.ndarray
STANDS = ("torsion", "bifilar", "trifilar", "compound", "springs")
#: Disturbance -> what it is, and the words of a warning that names it.
DISTURBANCES = {
    "white": ("white noise", None),
    "ar1": ("noise with memory (AR(1), 0.7 to 0.98)", "not white"),
    "mains": ("mains hum at 50 Hz, sampled at 20 to 100 Hz", "mains|does not decay"),
    "close": ("a second mode 0.6 to 3 lines of the record away", "cannot be distinguished|nearer to each other"),
    "jitter": ("time stamps that jitter by 2 to 10 % of a step", "jitter|even|clock"),
    "dry": ("dry friction", "dry friction|not exponentially"),
    "drag": ("quadratic drag", "drag|not exponentially"),
    "large": ("swing of 30 deg, or of 2 to 10 % of the springs' length", "amplitude"),
    "clipped": ("clipped, then low-pass filtered", "clip|flattened"),
    "short": ("1.5 to 5 periods", "periods|period|short"),
    "quantised": ("2 to 10 steps of resolution in the amplitude", "resolution|quantis|steps"),
}


class Repetition(NamedTuple):
    """One recording, what is known of it, and the truth."""

    signals: Signals
    description: dict[str, Any]
    truth: dict[str, float]


class Draw(NamedTuple):
    """Random numbers of n repetitions; amplitudes relative to the swing's.

    Attributes
    ----------
    periods, samples : of a record, and in a period
    decay : of the logarithm of the amplitude over the record by viscous damping
    noise : standard deviation
    """

    periods: Array
    samples: Array
    decay: Array
    noise: Array


def drawn(random: np.random.Generator, name: str, n: int) -> Draw:
    """Random numbers for a disturbance."""
    short = name == "short"
    return Draw(
        periods=random.uniform(1.5, 5.0, n) if short else random.uniform(20.0, 40.0, n),
        samples=random.uniform(30.0, 80.0, n) if short else random.uniform(15.0, 40.0, n),
        decay=random.uniform(0.0, 0.3, n) if name in ("dry", "drag", "short") else random.uniform(0.3, 2.0, n),
        noise=10.0 ** random.uniform(-3.0, -2.0, n),
    )


def disturbed(
    random: np.random.Generator,
    name: str,
    read: Callable[[Array], Array],
    rate: float,
    length: int,
    w: float,
    size: float,
    noise: float,
) -> tuple[Array, Array]:
    """Stated times and samples (N, c) of a motion with a disturbance; `size` is its amplitude at first."""  # fmt: skip
    t = np.arange(length) / rate
    if name == "clipped":
        corner = w * random.uniform(3.0, 8.0)
        t = t + 10.0 / corner
        x = motions.clipped(read, t, size * random.uniform(0.5, 0.95), corner, int(random.integers(1, 3)))
        t = t - t[0]
    elif name == "jitter":
        t = t + random.uniform(0.02, 0.1) / rate * np.clip(random.standard_normal(length), -3.0, 3.0)
        t -= t[0]
        x = read(t)
    else:
        x = read(t)
    sensors = x.shape[1]
    if name == "mains":
        hum, phase = 10.0 ** random.uniform(-2.5, -1.3), random.uniform(0.0, 2.0 * np.pi)
        share = random.uniform(0.3, 1.0, sensors)
        x = x + size * hum * share * np.cos(2.0 * np.pi * random.normal(50.0, 0.01) * t + phase)[:, None]
    if name == "close":
        other = w + random.choice([-1.0, 1.0]) * random.uniform(0.6, 3.0) * 2.0 * np.pi / t[-1]
        decay, phase = random.uniform(0.1, 2.0) / t[-1], random.uniform(0.0, 2.0 * np.pi)
        x = x + size * random.uniform(0.05, 0.4) * (np.exp(-decay * t) * np.cos(other * t + phase))[:, None]
    if name == "quantised":
        step = size / random.uniform(2.0, 10.0)
        x = x + random.uniform(-0.5, 0.5, sensors) * step
        x = x + step * random.uniform(0.0, 0.3) * random.standard_normal(x.shape)
        return t, step * np.round(x / step)
    if name == "ar1":
        colour = motions.coloured(random, x.shape, random.uniform(0.7, 0.98))
        return t, x + 2.0 * size * noise * colour
    return t, x + size * noise * random.standard_normal(x.shape)


def recording(t: Array, x: Array, unit: str, number: int) -> Signals:
    """Signals as of a file with a column of times."""
    names = ("time", *(f"s{c + 1}" for c in range(x.shape[1])))
    units = ("s", *([unit] * x.shape[1]))
    return Signals.of(names, np.column_stack([t, x]), units, None, path=f"{number}.csv", sha256=f"{number}")


# ------------------------------------------------------------------------------------------------ stands


def pendulums(kind: str, name: str, n: int, random: np.random.Generator) -> list[Repetition]:
    """Repetitions of a pendulum."""
    draw = drawn(random, name, n)
    u = random.uniform
    mass, gravity = 8.0, f"{motions.GRAVITY} m/s^2"
    if kind == "torsion":
        own = u(0.01, 0.03, n)
        swing = motions.Swing(kind=kind, inertia=own, stiffness=0.35)
        stand: dict[str, Any] = {"stiffness": "0.35 N m/rad"}
    elif kind == "compound":
        own = u(0.3, 0.8, n)
        swing = motions.Swing(kind=kind, inertia=own + mass * 0.4**2, mass=mass, distance=0.4)
        stand = {"distance": "0.4 m", "gravity": gravity}
    else:
        own = u(0.1, 0.3, n)
        above = 0.25 if kind == "bifilar" else 0.2
        swing = motions.Swing(kind=kind, inertia=own, mass=mass, length=1.2, radius=0.25, above=above)
        stand = {"radius": "0.25 m", "top_radius": f"{above} m", "length": "1.2 m", "gravity": gravity}
    body = {} if kind == "torsion" else {"mass": f"{mass} kg"}
    w = swing.frequency
    amplitude = np.full(n, np.radians(30.0)) if name == "large" else np.radians(u(1.0, 4.0, n))
    duration = draw.periods * 2.0 * np.pi / w
    rate = u(20.0, 100.0, n) if name == "mains" else draw.samples * w / (2.0 * np.pi)
    full: dict[str, Any] = {"viscous": 2.0 * draw.decay / duration * swing.inertia}
    if name == "dry":  # the amplitude falls by 2 dry / gain in half a period
        full["dry"] = u(0.4, 1.2, n) * amplitude * swing.gain / (4.0 * draw.periods)
    if name == "drag":  # 1 / amplitude rises by 4 q w t / (3 pi I)
        full["drag"] = u(0.5, 4.0, n) * 3.0 * np.pi * swing.inertia / (4.0 * amplitude * w * duration)
    phase = u(0.0, 2.0 * np.pi, n)
    path = motions.swung(
        motions.Swing(**{f: getattr(swing, f) for f in swing.__dataclass_fields__} | full),
        amplitude * np.cos(phase), -amplitude * w * np.sin(phase), 1.1 * duration + 10.0 / w,
    )  # fmt: skip
    found = []
    for k in range(n):
        length = max(16, int(duration[k] * rate[k]))
        t, x = disturbed(
            random, name, lambda t, k=k: path.at(k, t), float(rate[k]), length, float(w[k]), float(amplitude[k]),
            float(draw.noise[k]),
        )  # fmt: skip
        description = {"stand": {"kind": kind, **stand}, "body": body}
        truth = {"I_own": float(own[k])} if kind == "compound" else {"I": float(own[k])}
        found.append(Repetition(recording(t, x, "rad", k), description, truth))
    return found


#: Of the springs' stand: half length and half width, stiffness, length and mass.
A, B, K, L, M = 2.0, 0.8696, 740250.0, 0.5, 15190.0
POINTS = np.array([[A, 0.0, B], [A, 0.0, -B], [-A, 0.0, -B], [-A, 0.0, B]])


def springs(name: str, n: int, random: np.random.Generator) -> list[Repetition]:
    """Repetitions of a body on four springs: four vertical sensors; six more modes' worth where the swing is large."""
    draw = drawn(random, name, n)
    u = random.uniform
    centre = np.column_stack([u(-0.2, 0.2, n), np.zeros(n), u(-0.1, 0.1, n)])
    inertia = np.column_stack([u(3000.0, 6000.0, n), np.zeros(n), u(40e3, 50e3, n)])
    inertia[:, 1] = inertia[:, 2] + u(-0.8, 0.8, n) * inertia[:, 0]
    heave = float(np.sqrt(4.0 * K / M))
    duration = draw.periods * 2.0 * np.pi / heave
    if name == "close":  # pitch near heave
        centre[:, 0] = u(-0.02, 0.02, n)
        apart = 1.0 + u(0.6, 3.0, n) * 2.0 * np.pi / duration / heave * random.choice([-1.0, 1.0], n)
        inertia[:, 2] = M * A**2 / apart**2
        inertia[:, 1] = inertia[:, 2]
    six = name == "large"
    sensors, directions = POINTS, np.tile([0.0, 1.0, 0.0], (4, 1))
    if six:
        sensors = np.vstack([POINTS, POINTS[[0, 3]], POINTS[:1]])
        directions = np.vstack([directions, [[0.0, 0.0, 1.0]] * 2, [[1.0, 0.0, 0.0]]])
    size = L * (u(0.02, 0.1, n) if six else u(0.0005, 0.002, n))
    body = motions.Hanging(
        points=POINTS, stiffness=K, length=L, mass=np.full(n, M), centre=centre, inertia=inertia,
        viscous=draw.decay / duration * M / 2.0 * (0.5 if name in ("dry", "drag") else 1.0),
    )  # fmt: skip
    speed = size * heave
    if name == "dry":
        loss = u(0.4, 1.2, n) * size * K / (4.0 * draw.periods)
        body = motions.dataclasses.replace(body, dry=loss, slip=1e-2 * speed)
    if name == "drag":
        loss = u(0.5, 4.0, n) * 3.0 * np.pi * M / 4.0 / (4.0 * size * heave * duration)
        body = motions.dataclasses.replace(body, drag=loss)
    rest = body.rest()
    start = np.zeros((n, 6))
    start[:, 1] = size * random.choice([-1.0, 1.0], n) * u(0.3, 0.6, n)
    start[:, 5] = size / A * random.choice([-1.0, 1.0], n) * u(0.3, 0.6, n)
    start[:, 3] = size / B * random.choice([-1.0, 1.0], n) * u(0.3, 0.6, n)
    if six:
        start[:, [0, 2]] = size[:, None] * random.choice([-1.0, 1.0], (n, 2)) * u(0.3, 0.6, (n, 2))
        start[:, 4] = size / A * random.choice([-1.0, 1.0], n) * u(0.3, 0.6, n)
    x = motions.moved(rest, start)
    fastest = 2.2 * heave
    path = motions.shaken(body, x, float(1.1 * duration.max()) + 10.0 / heave, fastest, sensors, directions)
    base = motions.Path(path.step, path.value - body.readings(rest, sensors, directions)[0], path.rate)
    found = []
    for k in range(n):
        rate = float(u(20.0, 100.0)) if name == "mains" else float(max(draw.samples[k], 15.0) * heave / (2.0 * np.pi))
        length = max(16, int(duration[k] * rate))
        kind = "white" if name == "close" else name
        t, y = disturbed(
            random, kind, lambda t, k=k: base.at(k, t), rate, length, heave, float(size[k]), float(draw.noise[k])
        )
        asked = ("Ixx", "Iyy", "Izz") if six else ("Ixx", "Izz")
        values = dict(zip(("Ixx", "Iyy", "Izz"), inertia[k].tolist(), strict=True))
        description = {
            "signals": {
                "sensors": [
                    {"column": f"s{c + 1}", "point": p.tolist(), "direction": d.tolist()}
                    for c, (p, d) in enumerate(zip(sensors, directions, strict=True))
                ]
            },
            "stand": {
                "kind": "springs", "half_length": A, "half_width": B, "stiffness": K, "natural_length": L,
                "gravity": motions.GRAVITY,
            },
            "body": {
                "mass": M, "offset_x": float(centre[k, 0]), "offset_z": float(centre[k, 2]), "height": 0.0,
                **{key: "unknown" if key in asked else value for key, value in values.items()},
            },
        }  # fmt: skip
        found.append(Repetition(recording(t, y, "m", k), description, {key: values[key] for key in asked}))
    return found


def repetitions(stand: str, name: str, n: int) -> list[Repetition]:
    """Recordings of a stand with a disturbance, always the same."""
    random = np.random.default_rng([STANDS.index(stand), list(DISTURBANCES).index(name), 48])
    return springs(name, n, random) if stand == "springs" else pendulums(stand, name, n, random)


# ------------------------------------------------------------------------------------------------ counting


def counted(cases: list[Repetition], words: str | None, *, show: int = 0) -> dict[str, Any]:
    """What the evaluations of recordings give."""
    n = len(cases)
    refused, inside, inside_U, named, silent, evaluated = 0, 0, 0, 0, 0, 0
    ratios: list[float] = []
    relative: list[float] = []
    texts: dict[str, int] = {}
    began = clock.perf_counter()
    for k, one in enumerate(cases):
        try:
            found = mass_properties(one.signals, one.description)
        except InputError as error:
            refused += 1
            said = re.sub(r"[-+]?\d[\d.e+-]*", "#", str(error))[:110]
            texts["! " + said] = texts.get("! " + said, 0) + 1
            continue
        evaluated += 1
        off = [abs(found[key] - value) / found.std[found_index(found, key)] for key, value in one.truth.items()]
        held = all(
            found.interval[0][i] <= value <= found.interval[1][i]
            for key, value in one.truth.items()
            for i in [found_index(found, key)]
        )
        warnings = [w for w in found.warnings if not w.startswith("the description states no uncertainty")]
        warned = words is not None and any(re.search(words, w) for w in warnings)
        # with several values, all must be held: for one number, the first is counted
        ok = np.array(off) <= 2.0
        inside += float(ok.mean())
        inside_U += held
        named += warned
        silent += float((~ok).mean()) if not warned else 0.0
        ratios.append(float(max(off)))
        relative.append(max(found.std[found_index(found, key)] / value for key, value in one.truth.items()))
        for w in warnings:
            said = re.sub(r"[-+]?\d[\d.e+-]*", "#", w)[:110]
            texts[said] = texts.get(said, 0) + 1
        if show > 0 and max(off) > 3.0 and not warned:
            show -= 1
            modal = found.evaluations[0].modal
            print(f"   repetition {k}: {[round(float(v), 1) for v in off]}, {warnings}\n{modal.modes}")
    return {
        "repetitions": n,
        "refused": refused / n,
        "inside": inside / evaluated if evaluated else None,
        "inside_U": inside_U / evaluated if evaluated else None,
        "named": named / evaluated if evaluated else None,
        "silent": silent / n,
        "relative_u": float(np.median(relative)) if relative else None,
        "ratio": float(np.median(ratios)) if ratios else None,
        "seconds": (clock.perf_counter() - began) / n,
        "texts": dict(sorted(texts.items(), key=lambda item: -item[1])[:6]),
    }


def found_index(found: Any, key: str) -> int:
    """Place of an output."""
    return [o.key for o in found.outputs].index(key)


def line(stand: str, name: str, row: dict[str, Any]) -> str:
    """One line of the table as printed."""

    def share(value: float | None) -> str:
        return "    -" if value is None else f"{100.0 * value:5.1f}"

    ratio = "    -" if row["ratio"] is None else f"{row['ratio']:8.2f} {row['relative_u']:9.2g}"
    return (
        f"{stand:9s} {name:10s} inside {share(row['inside'])}  refused {share(row['refused'])}  named "
        f"{share(row['named'])}  silent {share(row['silent'])}  |e|/u {ratio}  {1e3 * row['seconds']:.0f} ms"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=pathlib.Path)
    parser.add_argument("--repetitions", type=int, default=200)
    parser.add_argument("--stands", default=",".join(STANDS))
    parser.add_argument("--only", default=",".join(DISTURBANCES))
    parser.add_argument("--show", type=int, default=0, help="repetitions with silent misses to print, a row")
    parser.add_argument("--texts", action="store_true", help="print the most frequent warnings and refusals")
    options = parser.parse_args()
    results: dict[str, Any] = (
        json.loads(options.output.read_text()) if options.output and options.output.exists() else {}
    )
    for stand in options.stands.split(","):
        for name in options.only.split(","):
            row = counted(repetitions(stand, name, options.repetitions), DISTURBANCES[name][1], show=options.show)
            print(line(stand, name, row), flush=True)
            texts = row.pop("texts")
            if options.texts:
                for text, count in texts.items():
                    print(f"      {count:4d} {text}")
            row.pop("seconds")
            row = {"what": DISTURBANCES[name][0], **row}
            results.setdefault(stand, {})[name] = row
            if options.output:
                options.output.write_text(json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    main()
