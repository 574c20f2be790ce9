"""Built-in cases of structures: each against a closed form or a published value, to files and back, and bad input."""

from __future__ import annotations

import dataclasses
import functools
import html
import math
import pathlib
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.optimize import brentq, least_squares

import evolvent as ev
from book import Book
from evolvent import cases
from evolvent.assembly.references import OF_THE_RUN
from evolvent.model.family import EXPLICIT
from evolvent.results.fine_samples import MARK
from evolvent.view import show
from families.rows import FAMILIES, Row, set_kinds
from layout import faults

NAMES = [name for name in cases.built_in() if cases.content_of(name)["system"] == "structure"]
#: Kinds of parts in each case.
KINDS = {name: {part["kind"] for part in cases.content_of(name)["parts"].values()} for name in NAMES}
#: For each kind the case with the fewest parts; tests of properties of each kind use the other cases in a release only.
OF_KINDS = {
    min((name for name in NAMES if kind in KINDS[name]), key=lambda name: (len(cases.content_of(name)["parts"]), name))
    for kind in set().union(*KINDS.values())
}
BY_KINDS = [pytest.param(name, marks=() if name in OF_KINDS else pytest.mark.release) for name in NAMES]
#: Ends of long runs for tests of files, s; tests of these cases run the others in full.
SHORT = {
    "boom-on-drum-stored": 0.01,
    "flexible-array-shell": 0.02,
    "heliogyro-strip-payout": 1.0,
    "miura-sheet": 0.002,
    "net-reflector": 0.005,
    "plate-swing": 0.02,
    "rib-antenna": 0.1,
    "rib-antenna-wound": 0.1,
    "rib-held-ten-years": 0.1,
    "rib-lenticular-shell": 2e-6,
    "rib-reflector": 0.1,
    "ring-antenna": 0.01,
    "solar-array-flexible": 0.5,
    "tape-drum": 0.02,
    "tape-hinge": 0.02,
    "tape-hinge-shell": 0.0005,
    "tape-rods-stored": 0.02,
    "z-fold": 1.0,
}


@functools.cache
def run(name: str) -> Any:
    """A built-in case, run once, up to its end in SHORT."""
    return ev.run(name, {"simulate.until": SHORT[name]} if name in SHORT else {})


def values(name: str, variable: str) -> np.ndarray:
    return np.asarray(run(name).ev.get(variable).values)


def fitted_frequencies(t: np.ndarray, x: np.ndarray, start: Sequence[float]) -> np.ndarray:
    """Frequencies (rad/s) of harmonic oscillations about a constant, by least squares from a first guess."""

    def rest(w: np.ndarray) -> np.ndarray:
        columns = [np.ones_like(t), *(f(one * t) for one in w for f in (np.cos, np.sin))]
        A = np.column_stack(columns)
        return A @ np.linalg.lstsq(A, x, rcond=None)[0] - x

    return least_squares(rest, start, x_scale=1e-3).x


# ---------------------------------------------------------------------------------------------- boom on a hub

#: Of boom-slew: hub, boom, tip mass, offset of the boom, wall of the tube.
HUB, LENGTH, TIP, OFFSET, RADII = (20.0, 2.0), 3.0, 0.5, 0.2, (0.01, 0.0097)
LINE_DENSITY = 1600.0 * math.pi * (RADII[0] ** 2 - RADII[1] ** 2)
BENDING = 70e9 * 0.25 * math.pi * (RADII[0] ** 4 - RADII[1] ** 4)


def characteristic(w: float) -> float:
    """Zero where a Bernoulli-Euler beam on a free hub, with a mass at its tip, vibrates at w."""
    mass, inertia = HUB
    b = (LINE_DENSITY * w * w / BENDING) ** 0.25

    def shape(x: float, order: int) -> np.ndarray:
        """Derivatives of cos, sin, cosh, sinh of b x."""
        c, s, ch, sh = math.cos(b * x), math.sin(b * x), math.cosh(b * x), math.sinh(b * x)
        trigonometric = [(c, s), (-s, c), (-c, -s), (s, -c)][order % 4]
        hyperbolic = (ch, sh) if order % 2 == 0 else (sh, ch)
        return b**order * np.array([*trigonometric, *hyperbolic])

    centre = shape(0.0, 0) - OFFSET * shape(0.0, 1)  # of the hub
    rows = [
        BENDING * shape(LENGTH, 2),
        BENDING * shape(LENGTH, 3) + w * w * TIP * shape(LENGTH, 0),
        BENDING * shape(0.0, 2) + w * w * (inertia * shape(0.0, 1) - OFFSET * mass * centre),
        BENDING * shape(0.0, 3) - w * w * mass * centre,
    ]
    return float(np.linalg.det(np.array([row / np.abs(row).max() for row in rows])))


@pytest.mark.slow
def test_boom_slew(book: Book) -> None:
    """Angular momentum 0.2 N m s, that of the torque; mean rate of a rigid body; free vibration."""
    t, rate = values("boom-slew", "time"), values("boom-slew", "hub.rate.z")
    momentum = values("boom-slew", "angular_momentum")[-1]
    assert momentum[:2] == pytest.approx([0.0, 0.0], abs=1e-12)
    book(
        "Dynamics", "Boom on a free hub, slewed: angular momentum", reference="integral of the torque, 0.2 N m s",
        source="closed form", error=abs(momentum[2] / 0.2 - 1.0), allowed=2e-5,
    )  # fmt: skip

    boom = LINE_DENSITY * LENGTH
    arms, masses = np.array([0.0, OFFSET + 0.5 * LENGTH, OFFSET + LENGTH]), np.array([HUB[0], boom, TIP])
    arms -= masses @ arms / masses.sum()
    J = HUB[1] + boom * LENGTH**2 / 12.0 + masses @ arms**2
    free = t >= 2.0
    first = brentq(characteristic, 5.0, 9.0)
    found = fitted_frequencies(t[free], rate[free], [first, 80.0])[0]
    periods = (t >= 2.0) & (t < 2.0 + 10.0 * 2.0 * math.pi / first)
    book(
        "Dynamics", "Boom on a free hub, slewed: mean rate after the slew", reference="H/J of the rigid craft",
        source="closed form", error=abs(rate[periods].mean() * J / 0.2 - 1.0), allowed=1e-3,
    )  # fmt: skip
    book(
        "Dynamics", "Boom on a free hub, slewed: vibration that remains", reference="first root, 7.0536 rad/s",
        source="Bernoulli-Euler beam on a free hub, tip mass", error=abs(found / first - 1.0), allowed=2e-3,
    )  # fmt: skip
    modes = ev.load("boom-slew").modes(count=8)
    pole = np.sort(np.abs(modes.pole.imag))
    assert np.all(pole[:6] < 1e-4 * first)
    book(
        "Modes", "Boom on a free hub, 12 elements", reference="first root, 7.0536 rad/s",
        source="Bernoulli-Euler beam on a free hub, tip mass", error=abs(pole[6] / first - 1.0), allowed=1e-3,
    )  # fmt: skip


# ---------------------------------------------------------------------------------------------- yo-yo, chain, Andrews


def test_yo_yo_despin(book: Book) -> None:
    """J. V. Fedor, NASA TN D-708, 1961: w = w0 (K R^2 - l^2)/(K R^2 + l^2), l = R w0 t; to rest at l = 7.228416 m."""
    drum, spin, K = 1.5, 5.0, 1.0 + 300.0 / (6.0 * 1.5**2)
    unwound = drum * spin * (values("yo-yo-despin", "time") + 1.0 / 150.0)
    wanted = spin * (K * drum**2 - unwound**2) / (K * drum**2 + unwound**2)
    rate = values("yo-yo-despin", "body.rate.z")
    assert unwound[-1] == pytest.approx(7.228416, abs=1e-5)
    assert rate[-1] == pytest.approx(0.0, abs=1e-5)
    free = np.linalg.norm(values("yo-yo-despin", "mass 1.position")[:, :2], axis=1)
    assert np.sqrt(free**2 - drum**2) == pytest.approx(unwound, rel=1e-8)
    book(
        "Threads, reels, tethers", "Yo-yo despin, the built-in case", reference="omega of length",
        source="closed form, Fedor 1961", error=np.abs(rate - wanted).max() / spin, allowed=1e-9,
    )  # fmt: skip


def test_hanging_chain(book: Book) -> None:
    """w^2 = x g/l with the zeros x of Laguerre's polynomial; from rest along the first mode, a sine."""
    x = np.sort(np.polynomial.laguerre.lagroots([0.0] * 8 + [1.0]).real)
    wanted = np.sqrt(x * 9.81 / 0.1)
    found = np.sort(np.abs(ev.load("hanging-chain").modes(count=16).pole.imag))
    book(
        "Modes", "Hanging chain of 8 links, in both planes", reference="zeros of Laguerre's polynomial L8",
        source="closed form", error=np.abs(found / np.repeat(wanted, 2) - 1.0).max(), allowed=1e-10,
    )  # fmt: skip
    swing = 0.01 / wanted[0]
    sine = swing * np.sin(wanted[0] * values("hanging-chain", "time"))
    book(
        "Dynamics", "Hanging chain of 8 links, first mode for 10 s", reference="sine of the first frequency",
        source="closed form", error=np.abs(values("hanging-chain", "mass 8.position.x") - sine).max() / swing,
        allowed=5e-5, unit="of the swing",
    )  # fmt: skip
    tension = values("hanging-chain", "link 1.tension")
    assert tension == pytest.approx(8 * 0.1 * 9.81, rel=1e-4)


@pytest.mark.slow
def test_andrews_mechanism(book: Book) -> None:
    """Angles of the seven bodies at 0.03 s by the IVP test set (Mazzia & Magherini 2008)."""
    beta, theta, gamma, phi, delta, omega, epsilon = (
        15.81077119629904, -15.75637105984298, 0.04082224013073101, -0.5347301163226948, 0.5244099658805304,
        0.5347301163226948, 1.048080741042263,
    )  # fmt: skip
    wanted = [beta, beta + theta, gamma, phi + delta, delta, omega + epsilon, epsilon]
    found = []
    for body in (f"K{k}" for k in range(1, 8)):
        q = values("andrews-mechanism", f"{body}.attitude")
        found.append(2.0 * np.unwrap(np.arctan2(q[:, 3], q[:, 0]))[-1])
    book(
        "Rigid bodies", "IFToMM A03, Andrews' mechanism, the built-in case", reference="seven angles at 0.03 s",
        source="IVP test set, Mazzia & Magherini 2008", error=np.abs(np.subtract(found, wanted)).max(), allowed=2e-4,
        unit="rad",
    )  # fmt: skip
    turned = values("andrews-mechanism", "O.angle")
    assert turned[-1] == pytest.approx(beta + 0.0617138900142764, abs=2e-4)


# ---------------------------------------------------------------------------------------------- tether and wire booms


def stretched_tether(spin: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Arc lengths, tension and spin of the tether at rest in the turning frame, with the momentum of the start."""
    masses, inertias, hooks, length = (200.0, 5.0), 30.0 + 0.05, (0.5, 0.1), 100.0
    area = math.pi * 0.0005**2
    EA, mu = 70e9 * area, 1300.0 * area
    step = length / 4000
    arc = step * (np.arange(4000) + 0.5)

    def places(tension: np.ndarray) -> tuple[np.ndarray, float, float]:
        """Distances from the common centre of the tether's pieces and of the end body; moment of inertia."""
        pieces = (1.0 + tension / EA) * step
        x, end = hooks[0] + np.cumsum(pieces) - 0.5 * pieces, hooks[0] + pieces.sum() + hooks[1]
        centre = (masses[1] * end + mu * step * x.sum()) / (sum(masses) + mu * length)
        r, far = x - centre, end - centre
        return r, far, inertias + masses[0] * centre**2 + masses[1] * far**2 + mu * step * r @ r

    tension = np.zeros_like(arc)
    momentum = spin * places(tension)[2]
    for _ in range(20):
        r, far, inertia = places(tension)
        spin = momentum / inertia
        pull = mu * step * spin**2 * r
        tension = masses[1] * spin**2 * far + np.cumsum(pull[::-1])[::-1] - 0.5 * pull
    return arc, tension, spin


def test_spinning_tether(book: Book) -> None:
    """N' = -mu w^2 r, N = m w^2 r at the end body; stretched, with the angular momentum that it started with."""
    arc, tension, spin = stretched_tether(0.1)
    found = values("spinning-tether", "tether.axial_force")[-20:].mean(axis=0)
    wanted = np.interp(values("spinning-tether", "tether.arc"), arc, tension)
    book(
        "Threads, reels, tethers", "Spinning tether with an end body: tension along it", reference="m w^2 r, mu w^2 r",
        source="closed form, with the stretch", error=np.abs(found / wanted - 1.0).max(), allowed=2e-5,
    )  # fmt: skip
    assert values("spinning-tether", "satellite.rate.z")[-20:].mean() == pytest.approx(spin, rel=5e-4)
    pull = np.linalg.norm(values("spinning-tether", "hook 2.force")[-20:], axis=1).mean()
    assert pull == pytest.approx(tension[-1], rel=1e-4)


def test_orbit_tether(book: Book) -> None:
    """Paid out at a rate in proportion to its length, it keeps its angle: sin 2 theta = -4 c/(3 n)."""
    n, c = 1.1e-3, 5.5e-4
    wanted = 0.5 * math.asin(-4.0 * c / (3.0 * n))
    line = values("orbit-tether", "end body.position") - values("orbit-tether", "satellite.position")
    length = np.linalg.norm(line, axis=1)
    book(
        "Threads, reels, tethers", "Tether paid out in orbit from 20 to 349 m: angle to the vertical",
        reference="sin 2 theta = -4 c/(3 n)", source="closed form, light tether",
        error=np.abs(np.arctan2(line[:, 1], line[:, 0]) - wanted).max(), allowed=5e-4, unit="rad",
    )  # fmt: skip
    mass = 500.0 * 20.0 / 520.0  # both bodies swing about their common centre of mass
    tension = mass * length * (3.0 * (n * math.cos(wanted)) ** 2 - c * c)
    found = np.linalg.norm(values("orbit-tether", "tether.end_force"), axis=-1)
    late = slice(100, None)  # every node that leaves makes the tether ring for a while
    book(
        "Threads, reels, tethers", "Tether paid out in orbit from 20 to 349 m: tension at the end body, mean",
        reference="m L (3 n^2 cos^2 theta - c^2)", source="closed form, light tether",
        error=abs((found / tension)[late].mean() - 1.0), allowed=2e-2,
    )  # fmt: skip


@pytest.mark.slow
def test_two_booms(book: Book) -> None:
    """The pulse's end of the frame moves as one of 24-coordinate elements does."""
    content = cases.content_of("two-booms")
    for name in ("inner boom", "outer boom"):
        content["parts"][name] |= {"kind": "beam", "elements": 16}
    beams = ev.run(content, {"simulate.fine": False})
    moved = run("two-booms").ev.regular()["outer boom"].position.values[:, -1, 2]
    book(
        "Dynamics", "Two booms at a right angle under a triangular pulse (rod, 8 elements each), 0.5 s",
        reference="tip across the plane, beams of 16 elements", source="other elements",
        error=np.abs(moved - beams["outer boom"].position.values[:, -1, 2])[:101].max() / np.abs(moved).max(),
        allowed=5e-3,
    )  # fmt: skip


@pytest.mark.slow
def test_wire_booms(book: Book) -> None:
    """Wires as stiff pendulums with an offset hinge (W. Johnson, Helicopter Theory, 1980), alone and with the hub."""
    offset, length, tip, mu, inertia = 0.6, 20.0, 0.25, 6000.0 * math.pi * 0.0004**2, 60.0
    S, I = tip * length + 0.5 * mu * length**2, tip * length**2 + mu * length**3 / 3.0  # noqa: E741
    Jb = inertia / 4.0 + (tip + mu * length) * offset**2
    together = math.sqrt(offset * S * (Jb + I + 2.0 * offset * S) / (I * Jb - (offset * S) ** 2))
    wanted = {
        "in the plane": math.sqrt(offset * S / I),
        "out of the plane": math.sqrt(1.0 + offset * S / I),
        "all against the hub": together,
    }
    poles = np.abs(ev.load("wire-boom-satellite").modes(count=14, rotating=(0.0, 0.0, 1.0)).pole.imag)
    for motion, one in wanted.items():
        book(
            "Modes", f"Spinning satellite with wire booms, {motion}", reference="stiff wires on offset hinges",
            source="closed form, Johnson 1980; Lagrange", error=np.abs(poles / one - 1.0).min(), allowed=5e-4,
        )  # fmt: skip
    t, rate = values("wire-boom-satellite", "time"), values("wire-boom-satellite", "hub.rate.z")
    free = t >= 12.0
    found = fitted_frequencies(t[free], rate[free], [0.52])[0]
    whole = inertia + 4.0 * ((tip + mu * length) * offset**2 + 2.0 * offset * S + I)
    spin = 1.0 + 1.5 / whole  # the pulse gives 1.5 N m s
    book(
        "Dynamics", "Spinning satellite with wire booms after a pulse", reference="all wires against the hub",
        source="closed form, Lagrange", error=abs(found / (spin * together) - 1.0), allowed=5e-4,
    )  # fmt: skip
    momentum = values("wire-boom-satellite", "angular_momentum.z")
    assert momentum[-1] - momentum[49] == pytest.approx(1.5, rel=2e-4)


# ---------------------------------------------------------------------------------------------- files


def test_each_case_is_listed(call: Callable[..., tuple[int, str, str]]) -> None:
    assert len(NAMES) >= 6
    code, out, _ = call("list")
    assert code == 0
    for name in NAMES:
        line = next(line for line in out.splitlines() if line.startswith(f"{name} "))
        assert len(line.removeprefix(name).strip()) > 20


@pytest.mark.release
def test_the_strips_that_are_paid_out_run_to_their_end() -> None:
    assert ev.run("heliogyro-strip-payout").attrs["status"] == "success"


@pytest.fixture(scope="module", params=NAMES)
def name(request: pytest.FixtureRequest) -> str:
    """A built-in case; tests of one case follow one another, so that they share its run."""
    return request.param


@pytest.mark.slow
def test_a_case_runs(name: str) -> None:
    found = run(name)
    assert found.attrs["status"] == "success"
    assert found.attrs["system"] == "structure"
    assert found.attrs["title"] == cases.content_of(name)["title"] == found.ev.motion().title
    assert found.ev.table()


@pytest.mark.slow
@pytest.mark.parametrize("name", BY_KINDS, indirect=True, scope="module")
def test_a_run_comes_back_from_its_file(name: str, tmp_path: Any) -> None:
    found = run(name)
    ev.save(found, tmp_path / "run.nc")
    back = ev.open(tmp_path / "run.nc")
    assert back.identical(found)
    assert back.ev.names() == found.ev.names()
    labels = [(number.label, number.value) for number in found.ev.table()]
    assert [(number.label, number.value) for number in back.ev.table()] == labels
    page = pathlib.Path(back.ev.animate(tmp_path / "motion.html")).read_text(encoding="utf-8")
    assert f"<title>{found.attrs['title']}</title>" in html.unescape(page)


@pytest.mark.slow
@pytest.mark.parametrize("name", BY_KINDS, indirect=True, scope="module")
def test_nothing_is_cut_off_or_covered_in_its_figures(name: str) -> None:
    figures = cases.presenter(run(name)).figures(run(name))
    assert len(figures) >= 2
    assert [fault for figure in figures for fault in faults(figure)] == []


@pytest.mark.slow
@pytest.mark.parametrize("name", BY_KINDS, indirect=True, scope="module")
def test_a_system_written_and_read_gives_the_same_numbers(name: str) -> None:
    """To the last bit; also through the case that the run keeps."""
    system = ev.load(name)
    text = system.to_yaml()
    again = ev.load(cases.parse_yaml(text, "text"))
    assert again.parts == system.parts
    assert again.title == system.title
    assert again.to_yaml() == text
    until = SHORT.get(name, 0.1 * system.settings["until"])
    one = run(name) if name in SHORT else system.simulate(until=until)
    assert again.simulate(until=until).equals(one)
    kept = ev.load(cases.parse_yaml(run(name).attrs["case"], "the run's case"))
    assert kept.parts == system.parts
    ends = {"until": SHORT[name]} if name in SHORT else {}
    assert kept.settings == {"method": "auto"} | system.settings | ends


# ---------------------------------------------------------------------------------------------- bad input

HEAD = "system: structure\nsimulate: {until: 1 s}\nparts:\n"
BOB = "  bob: {kind: point, mass: 1 kg}\n"
BAD = {
    "a misspelt kind": (
        "  bob: {kind: pont, mass: 1 kg}\n", "parts.bob.kind is 'pont'; did you mean 'point'?",
    ),
    "a misspelt key": (
        "  bob: {kind: point, mas: 1 kg}\n", "unknown key 'parts.bob.mas'; did you mean 'parts.bob.mass'?",
    ),
    "a misspelt reference": (
        f"{BOB}  rod: {{kind: spring, a: [0, 0, 1 m], b: bbo, stiffness: 1 N/m}}\n",
        "'rod' refers to 'bbo', but no part is called that; did you mean 'bob'?",
    ),
    "a misspelt point": (
        "  hub: {kind: rigid-body, mass: 1 kg, inertia: 1, points: {left: [1, 0, 0 m]}}\n"
        "  rod: {kind: spring, a: [0, 0, 1 m], b: hub.lefft, stiffness: 1 N/m}\n",
        "rod.b is 'hub.lefft'",
    ),
    "a wrong unit": ("  bob: {kind: point, mass: 1 m}\n", "parts.bob.mass is '1 m'; "),
    "a wrong unit in a list": (
        "  bob: {kind: point, mass: 1 kg, position: [0, 0, 1 kg]}\n", "parts.bob.position is [0, 0, '1 kg']; ",
    ),
    "a circle of references": (
        "  one: {kind: point, mass: 1 kg, at: two}\n  two: {kind: point, mass: 1 kg, at: one}\n",
        "the parts 'one' -> 'two' -> 'one' refer to one another in a cycle",
    ),
    "a part that refers to itself": (
        "  one: {kind: point, mass: 1 kg, at: one}\n", "'one' refers to itself; it must refer to another part",
    ),
    "the name of a result of the run": (
        "  energy: {kind: point, mass: 1 kg}\n",
        "the name of a part is 'energy', which is a result of the whole run; use another",
    ),
    "two parts of one name": (BOB + BOB, "the key 'bob' is given twice"),
    "no parts": ("", "parts is empty"),
    "a missing key": ("  bob: {kind: point}\n", "parts.bob.mass is missing"),
    "an expression that is none": (
        f"{BOB}  rod: {{kind: spring, a: [0, 0, 1 m], b: bob, law: 'k*y', constants: {{k: 1}}}}\n", "rod.law",
    ),
    "code in an expression": (
        f"{BOB}  rod: {{kind: spring, a: [0, 0, 1 m], b: bob, law: '__import__(1)'}}\n", "parts.rod.law",
    ),
    "a profile of one row": (
        f"{BOB}  push: {{kind: load, at: bob, direction: [1, 0, 0], profile: [[0 s, 1 N]]}}\n", "parts.push.profile",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("text", "words"), BAD.values(), ids=BAD.keys())
def test_bad_input_is_one_line_that_names_the_part(
    text: str, words: str, call: Callable[..., tuple[int, str, str]], tmp_path: Any
) -> None:
    (tmp_path / "bad.yaml").write_text(HEAD + text)
    code, out, err = call("run", "bad.yaml", "--no-figures")
    assert code == 2
    assert out == ""
    assert len(err.splitlines()) == 1, err
    assert words in err
    assert "Traceback" not in err


def test_a_case_of_parts_needs_no_key_system(call: Callable[..., tuple[int, str, str]], tmp_path: Any) -> None:
    text = HEAD.partition("\n")[2] + BOB
    (tmp_path / "bare.yaml").write_text(text)
    code, out, err = call("run", "bare.yaml", "--no-figures", "--set", "parts.bob.velocity=[1, 0, 0 m/s]")
    assert (code, err) == (0, "")
    assert "bob.position" in out
    system = ev.load(cases.parse_yaml(text, "bare"))
    assert list(system.parts) == ["bob"]
    code, _, err = call("modes", "bare.yaml", "--set", "sytem=structure")
    assert (code, err.strip()) == (2, "evolvent: unknown key 'sytem'; did you mean 'system'?")
    (tmp_path / "neither.yaml").write_text("simulate: {until: 1 s}\n")
    code, _, err = call("run", "neither.yaml")
    assert code == 2
    assert "the key 'system' is missing" in err


CANTILEVER = """\
gravity: [0, 0, -2 m/s^2]
parts:
  boom:
    {kind: beam, length: 2 m, section: {rectangle: {thickness: 2 mm, width: 20 mm}}, elements: 6, normal: [0, 0, 1],
     material: {young_modulus: 70 GPa, poisson_ratio: 0, density: 1600 kg/m^3}}
  wall: {kind: joint, a: [0, 0, 0 m], b: boom.root, type: clamp}
  end: {kind: point, mass: 10 g, at: boom.tip}
"""


@pytest.mark.slow
def test_the_command_equilibrium_draws_along_the_parts(
    call: Callable[..., tuple[int, str, str]], tmp_path: Any
) -> None:
    """Of a cantilever under its weight, of which the moment at the root is w L^2/2 + m g L."""
    (tmp_path / "cantilever.yaml").write_text(CANTILEVER)
    code, out, err = call("equilibrium", "cantilever.yaml", "-o", "rest.nc", "--figures", "drawn")
    assert (code, err) == (0, "")
    assert "figures: along-boom.png, shape.html in drawn" in out
    assert {path.name for path in (tmp_path / "drawn").iterdir()} == {"along-boom.png", "shape.html"}
    rest = ev.open(tmp_path / "rest.nc")
    (sheet,) = show.figures(rest)
    labels = [panel.y_label for panel in sheet.panels]
    assert labels[0] == "deflection, m"
    line_load = 1600.0 * 0.002 * 0.02 * 2.0
    bending = next(p for p in sheet.panels if p.y_label.startswith("bending moment") and p.lines[0].y[0] != 0.0)
    (line,) = bending.lines
    left = 2.0 - line.x
    wanted = line_load * left**2 / 2.0 + 0.01 * 2.0 * left
    # each element's is its mean, off by w h^2/24; the strip bends so far that the arm is 1 % shorter
    np.testing.assert_allclose(np.abs(line.y), wanted, rtol=1.5e-2, atol=1.2 * line_load * (1.0 / 3.0) ** 2 / 24.0)


def test_files_of_modes_say_what_they_hold(call: Callable[..., tuple[int, str, str]], tmp_path: Any) -> None:
    code, out, _ = call("modes", "hanging-chain", "--count", "3", "-o", "modes.nc")
    assert code == 0
    assert "modes: modes.nc" in out
    with xr.open_dataset(tmp_path / "modes.nc") as found:
        assert found.frequency_hz.size == 3
        assert "evolvent" in found.attrs["made_with"]
    for command in ("info", "plot"):
        code, _, err = call(command, "modes.nc")
        assert (code, "it holds modes, not a run" in err) == (2, True)


def test_names_of_results_of_the_run_are_those_that_no_part_takes() -> None:
    assert set(run("yo-yo-despin").to_dataset().variables) == OF_THE_RUN - {MARK}


def test_a_method_that_does_not_support_a_part_names_it(
    call: Callable[..., tuple[int, str, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    name, advice = "a thread with segments of fixed length", "use dopri5"
    given = {"solvers": frozenset({EXPLICIT}), "advice": advice}
    rows = [Row(row.records, dataclasses.replace(row.kind, **given)) if row.name == name else row for row in FAMILIES]
    set_kinds(monkeypatch, rows)
    fixed = ("--set", "parts.tether.segments=inextensible", "--set", "parts.tether.end=")
    code, _, err = call("run", "orbit-tether", *fixed, "--no-figures")
    assert code == 2
    assert "'tether' is a thread with segments of fixed length, which generalized-alpha does not support" in err
    assert "dopri5" in err
