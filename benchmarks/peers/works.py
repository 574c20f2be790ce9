"""What every program is given to do, who takes part and how, and the references. Plain numbers, SI units, z or y up."""

from __future__ import annotations

import importlib.util
import pathlib
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

G = 9.81
#: A cable of square section, pinned at one end, falls from the horizontal; the place compared is its tip.
CABLE = {
    "length": 1.0,
    "side": 0.02,
    "E": 2e7,
    "nu": 0.3,
    "density": 7200.0,
    "gravity": G,
    "elements": 40,
    "samples": [0.0, 0.5, 1.0],
}
#: A line of lumped masses on springs with a bob at its end, released from its catenary; the bob's place is compared.
LINE = {
    "length": 2.0,
    "segments": 20,
    "density": 0.1,
    "EA": 1000.0,
    "BA": 0.05,
    "bob": 1.0,
    "end": [1.5, 0.0, -1.3],
    "gravity": G,
    "samples": [0.0, 0.5, 1.0],
}
#: A rigid body hangs on four springs and is released while rotating; the place compared is a corner's.
BODY = {
    "mass": 2.0,
    "inertia": [0.02, 0.03, 0.04],
    "corners": [[0.3, 0.2, 0.0], [-0.3, 0.2, 0.0], [-0.3, -0.2, 0.0], [0.3, -0.2, 0.0]],
    "height": 0.5,
    "stiffness": 400.0,
    "damping": 0.0,
    "natural": 0.49,
    "spin": [0.3, 0.2, 1.0],
    "gravity": G,
    "samples": [0.0, 1.0, 2.0],
}
#: The same body with masses from 1.5 to 2.5 kg; the centres at the end are compared.
VARIANTS = BODY | {"masses": [1.5 + k / 99.0 for k in range(100)], "samples": [0.0, 2.0]}

WORKS: dict[str, dict[str, Any]] = {
    "cable": {
        "title": "A cable that swings down",
        "text": "A cable of 1 m, 0.02 m x 0.02 m, E = 20 MPa, 7200 kg/m3, 40 elements, pinned at one end, falls "
        "from the horizontal for 1 s; the tip is compared. Cables have neither shear nor rotary inertia, "
        "the other rods have both, and each is compared with its own theory. Explicit methods support no "
        "constraint on a beam in evolvent: its pin is then a spring of 1 MN/m; a rod's is a constraint.",
        "spec": CABLE,
        "size": 1.0,
    },
    "line": {
        "title": "A line of lumped masses with a bob",
        "text": "20 segments of 0.1 m (EA 1000 N, damping 0.05 N s, 0.1 kg/m) with 1 kg at the end, released "
        "from their catenary, swing for 1 s; the end is compared. The masses start from a closed form, except in "
        "MoorDyn, which finds its own catenary to 1e-6 m. RK4's limit is about 1.4 ms.",
        "spec": LINE,
        "size": 2.0,
    },
    "body": {
        "title": "A rigid body on four springs",
        "text": "2 kg on four springs of 400 N/m, released while rotating at about 1 rad/s; a corner is compared "
        "over 2 s.",
        "spec": BODY,
        "size": 0.36,
    },
    "variants": {
        "title": "100 variants of the body",
        "text": "The body above with masses from 1.5 to 2.5 kg, each for 2 s; the centres at the end are compared. "
        "evolvent: `simulate_many`, whose time includes the building of every variant, its checks and the values that "
        "are kept. MuJoCo: `mujoco.rollout` with its pool of threads, models compiled beforehand (in the total). A "
        "step is one of one variant.",
        "spec": VARIANTS,
        "size": 0.36,
    },
}

#: Who does which work: program, what the row is called, options of the program's own module, steps that are compared
#: (s; the first is the one whose time is told), steps that are too large.
WAYS: list[dict[str, Any]] = [
    *(
        {
            "work": "cable",
            "program": program,
            "label": label,
            "reference": reference,
            "options": options,
            "steps": [1e-3, 5e-4],
            "large": [0.02, 0.05],
        }
        for program, label, reference, options in (
            ("evolvent", "cable_stretch, generalized-alpha", "cable", {"formulation": "cable_stretch"}),
            ("exudyn", "ANCFCable, generalized-alpha", "cable", {"element": "ANCFCable"}),
            ("evolvent", "assumed_strain, generalized-alpha", "beam", {"formulation": "assumed_strain"}),
        )
    ),
    *(
        {
            "work": "cable",
            "program": program,
            "label": label,
            "reference": reference,
            "options": options,
            "steps": steps,
            "large": large,
        }
        for program, label, reference, options, steps, large in (
            (
                "evolvent",
                "cable_stretch, RK4",
                "cable",
                {"formulation": "cable_stretch", "method": "rk4"},
                [1e-4, 5e-5],
                [4e-4, 1e-3],
            ),
            ("evolvent", "rod, RK4", "beam", {"part": "rod", "method": "rk4"}, [5e-4, 1e-4], [1e-3, 2e-3]),
            ("pyelastica", "Cosserat rod, position Verlet", "beam", {}, [1e-4, 5e-5], [4e-4, 1e-3]),
        )
    ),
    *(
        {
            "work": "line",
            "program": program,
            "label": label,
            "reference": "line",
            "options": options,
            "steps": [1e-3, 5e-4],
            "large": [1.5e-3, 3e-3],
        }
        for program, label, options in (
            ("evolvent", "points and springs, RK4", {}),
            ("exudyn", "mass points and springs, RK44", {}),
            ("moordyn", "line without water, RK4", {}),
            ("mujoco", "points and tendons, RK4", {"integrator": "RK4"}),
            ("mujoco", "points and tendons, Euler (its default)", {"integrator": "Euler"}),
            ("scipy", "the same equations in NumPy, RK45 with a fixed step", {}),
        )
    ),
    *(
        {
            "work": "body",
            "program": program,
            "label": label,
            "reference": "body",
            "options": options,
            "steps": [1e-2, 5e-3],
            "large": [0.045, 0.1],
        }
        for program, label, options in (
            ("evolvent", "RK4", {}),
            ("exudyn", "Lie group, RK44", {}),
            ("mujoco", "RK4", {"integrator": "RK4"}),
            ("mujoco", "Euler (its default)", {"integrator": "Euler"}),
            ("scipy", "the same equations in NumPy, RK45 with a fixed step", {}),
        )
    ),
    *(
        {
            "work": "variants",
            "program": program,
            "label": f"{label}, {threads} {'threads' if threads > 1 else 'thread'}",
            "reference": "variants",
            "options": {"threads": threads},
            "steps": [1e-3, 5e-4],
            "large": [],
        }
        for threads in (1, 2)
        for program, label in (("evolvent", "simulate_many, RK4"), ("mujoco", "rollout, RK4"))
    ),
]


def catenary(spec: dict[str, Any]) -> np.ndarray:
    """Nodes of an elastic line that hangs at rest between the origin and its end, m : (segments + 1, 3)."""
    L, EA, w = spec["length"], spec["EA"], spec["density"] * spec["gravity"]
    s = np.linspace(0.0, L, spec["segments"] + 1)

    def places(pull: np.ndarray) -> np.ndarray:
        H, V = pull  # along x, and downwards, on the line at its lower end
        below = V + w * (L - s)  # carried at s by what hangs below
        top = V + w * L
        x = H * s / EA + H / w * (np.arcsinh(top / H) - np.arcsinh(below / H))
        z = -((top**2 - below**2) / (2.0 * w * EA) + (np.hypot(H, top) - np.hypot(H, below)) / w)
        return np.stack([x, 0.0 * s, z], axis=1)

    x, _, z = spec["end"]
    # the chord's pull, from the sag of a shallow arc, is a good start
    chord = np.hypot(x, z)
    pull = w * L / np.sqrt(24.0 * max(L / chord - 1.0, 1e-6))
    start = np.array([pull * x / chord, -pull * z / chord])
    found = fsolve(lambda p: places(p)[-1, [0, 2]] - [x, z], start, xtol=1e-14)
    nodes = places(found)
    if np.abs(nodes[-1] - spec["end"]).max() > 1e-9:
        raise RuntimeError("the catenary was not found")
    return nodes


def complete() -> None:
    """What follows from the numbers above: the line's first places."""
    LINE["nodes"] = catenary(LINE).tolist()


# ------------------------------------------------------------------------------------------------ references


def discrete_rod(n: int) -> np.ndarray:
    """Tip of the cable as n + 1 masses, springs between them and rotational springs at them, m : (samples, 2).

    No shear and no rotary inertia, as in a cable; strain and curvature by the undeformed length.
    """
    c = CABLE
    h, area = c["length"] / n, c["side"] ** 2
    EA, EI = c["E"] * area, c["E"] * c["side"] ** 4 / 12.0
    mass = np.full(n + 1, c["density"] * area * h)
    mass[-1] *= 0.5

    def rates(_: float, state: np.ndarray) -> np.ndarray:
        x, v = state.reshape(2, n + 1, 2)
        d = np.diff(x, axis=0)
        long = np.hypot(d[:, 0], d[:, 1])
        t = d / long[:, None]
        cross = t[:-1, 0] * t[1:, 1] - t[:-1, 1] * t[1:, 0]
        moment = EI / h * np.arctan2(cross, np.sum(t[:-1] * t[1:], axis=1))
        across = np.stack([-t[:, 1], t[:, 0]], axis=1) / long[:, None]
        inner = EA * (long / h - 1.0)[:, None] * t  # force that a segment pulls its first end with
        inner[:-1] -= moment[:, None] * across[:-1]
        inner[1:] += moment[:, None] * across[1:]
        a = np.zeros_like(x)
        a[:-1] += inner
        a[1:] -= inner
        a /= mass[:, None]
        a[:, 1] -= c["gravity"]
        a[0] = 0.0
        return np.stack([v, a]).ravel()

    start = np.zeros((2, n + 1, 2))
    start[0, :, 0] = np.linspace(0.0, c["length"], n + 1)
    times = c["samples"]
    found = solve_ivp(rates, (0.0, times[-1]), start.ravel(), "DOP853", times[1:], rtol=1e-8, atol=1e-10)
    return found.y.T.reshape(-1, 2, n + 1, 2)[:, 0, -1]


def extrapolated(tips: Any) -> tuple[list[list[float]], float]:
    """Places of an infinitely fine mesh, z = 0, from three of second order, and how far two estimates differ, m."""
    coarse, middle, fine = (np.asarray(tips(n)) for n in (20, 40, 80))
    first, second = middle + (middle - coarse) / 3.0, fine + (fine - middle) / 3.0
    return [[*map(float, p), 0.0] for p in second], float(np.abs(second - first).max())


def reissner() -> Any:
    """The finite-volume beam with shear and rotary inertia that the tests of validation use."""
    path = pathlib.Path(__file__).parents[2] / "tests" / "validation" / "flexible_pendulum.py"
    spec = importlib.util.spec_from_file_location("flexible_pendulum", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return lambda n: module.tips(n, False)


def references() -> dict[str, dict[str, Any]]:
    """Places at the samples but the first, what they were found by, and how sure they are."""
    import with_scipy

    known = {}
    for name, tips, text in (
        ("cable", discrete_rod, "masses, springs and rotational springs under DOP853, extrapolated from 40 and 80"),
        ("beam", reissner(), "finite volumes with shear and rotary inertia, DOP853, extrapolated from 40 and 80"),
    ):
        places, sure = extrapolated(tips)
        known[name] = {"places": places, "sure": sure, "text": text}
    for name in ("line", "body"):
        spec = WORKS[name]["spec"]
        tight, tighter = (with_scipy.tight(name, spec, rtol) for rtol in (1e-10, 1e-12))
        known[name] = {
            "places": tighter.tolist(),
            "sure": float(np.abs(tight - tighter).max()),
            "text": "the same equations under SciPy's DOP853 at 1e-12",
        }
    tight, tighter = (np.array([with_scipy.tight("centre", VARIANTS | {"mass": mass}, rtol)[0] for mass in
                                VARIANTS["masses"]]) for rtol in (1e-10, 1e-12))  # fmt: skip
    known["variants"] = known["body"] | {"places": tighter.tolist(), "sure": float(np.abs(tight - tighter).max())}
    return known
