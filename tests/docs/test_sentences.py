"""Sentences of the documentation that state numbers: each stands in its files, and its numbers are right.

In the table braces mark the numbers. ``{4.3}`` must be the computed number rounded to as many digits, ``{<1e-4}`` is
``1e-4`` in the file, below which the computed number must be in size, and ``{0.2 to 0.5}`` a range in which it must
be: numbers of chaotic motions and of adaptive steps hang on round-off, which is each processor's own. What takes long
names the test file that holds the number instead.
"""

from __future__ import annotations

import ast
import dataclasses
import functools
import math
import pathlib
import re
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest

import evolvent
from evolvent import cases, closed_forms
from evolvent_massprops.inertia import Body, Stand, vertical_model
from evolvent_papers.papers import ledger, rib_runs
from evolvent_papers.wrapped_rib.case_checks import bending_stiffness_ratio

ROOT = pathlib.Path(__file__).parents[2]
PAPERS = "packages/evolvent-papers/tests"
_NUMBER = re.compile(r"\{(<?)([^{}]+)\}")


@dataclasses.dataclass(frozen=True)
class Sentence:
    """A fragment with its numbers in braces, the files that hold it, and what computes the numbers or holds them."""

    text: str
    files: tuple[str, ...]
    numbers: Callable[[], Sequence[float]] | None = None
    held: str = ""

    @property
    def plain(self) -> str:
        """The fragment as it stands in the files."""
        return _NUMBER.sub(lambda match: match[2], self.text)


# ------------------------------------------------------------------------------------------------ heliogyro


@functools.cache
def blades(nodes: int, **changes: Any) -> Any:
    """A deployment of the heliogyro on links of fixed length."""
    fixed = {"blade.segments": "inextensible", "solver.method": "dopri5", "solver.rtol": 1e-6, "solver.atol": 1e-8}
    return evolvent.run("heliogyro", fixed | {"blade.nodes": nodes} | changes)


@functools.cache
def on_springs(**changes: Any) -> Any:
    """A deployment on springs; `__` stands for the dot of a key."""
    return evolvent.run("heliogyro", {key.replace("__", "."): value for key, value in changes.items()})


def tip_lag(run: Any) -> np.ndarray:
    """Lag of the first blade's tip, deg, at the regular samples."""
    return np.degrees(run.ev.regular().tip_lag.values[:, 0])


def largest(values: np.ndarray, start: float) -> float:
    """Largest size of values at samples of 0.1 s from a time on."""
    return float(np.nanmax(np.abs(values[round(start / 0.1) :])))


def gaps(formula: str) -> list[float]:
    """Largest gaps of a formula to the rate of the body, %, with 20 and 40 nodes."""
    runs = [blades(nodes) for nodes in (20, 40)]
    return [100.0 * float(np.abs(run[formula].values / run.body_rate.values - 1.0).max()) for run in runs]


def end_rate() -> list[float]:
    """Rate of the body at the end, rad/s."""
    return [float(blades(20).body_rate[-1])]


def momenta() -> list[float]:
    """Shares of the angular momentum, %: that of new nodes, what turning takes from them, that of wound thread."""
    runs = [on_springs(blade__stiffness=100.0, blade__rotate_velocity=turn) for turn in (False, True)]
    start = float(runs[0].angular_momentum[0, 2])
    gained, turned = (100.0 * float(run.angular_momentum_jumps[-1]) / start for run in runs)
    return [gained, gained - turned, 100.0 * float(runs[0].angular_momentum_wound.max()) / start]


def off_by_springs() -> list[float]:
    """Largest difference of the lag on springs of 1e4 N/m from that on links, deg."""
    return [largest(tip_lag(on_springs()) - tip_lag(blades(20)), 5.0)]


def off_by_nodes() -> list[float]:
    """Largest differences of the lag from that of 160 nodes, deg."""
    return [largest(tip_lag(blades(nodes)) - tip_lag(blades(160)), 5.1) for nodes in (20, 40, 80)]


def off_by_damping() -> list[float]:
    """Largest difference of the lag between dampings of 1e-6 and 1 N s/m, deg."""
    few, much = (tip_lag(on_springs(blade__damping=d, solver__duration=20.0)) for d in (1e-6, 1.0))
    return [largest(few - much, 1.0)]


def tensions() -> list[float]:
    """Largest mean and largest sample of the tension at the spool, N, as the table gives them."""
    rows = {number.label: number.value for number in cases.presenter(on_springs()).numbers(on_springs())}
    found = [value for label, value in rows.items() if label.startswith("largest hub tension")]
    return [float(text.partition(" N")[0]) for text in found]


# ------------------------------------------------------------------------------------------------ inertia stand


def least_energies() -> list[float]:
    """Of a box of 20 %: share with less than 1 % of the energy at its middle, %; energies at a corner, of the best, J.

    All are the least of the modes' energies: by the load on one spring, at the corner where that is least, and in all
    of the box by the load on the best spring.
    """
    stand = Stand.rectangle(2.0, 0.8696, stiffness=740250.0, length=0.5, support="hanging")
    x, z = np.meshgrid(np.linspace(-0.8, 0.8, 101), np.linspace(-0.34784, 0.34784, 101), indexing="ij")
    centre = np.stack([x, np.zeros_like(x), z], axis=-1)
    body = Body(mass=15190.0, centre=centre, inertia=np.diag([3703.0, 43920.0, 43920.0]))
    modes = vertical_model(stand, body).modes()
    released = [modes.release((0.0, -9806.65, 0.0), point) for point in stand.points]
    energy = np.array([modes.energy(one).min(axis=-1) for one in released])
    one = energy[0]
    return [100.0 * np.mean(one < 0.01 * one[50, 50]), one[::100, ::100].min(), energy.max(axis=0).min()]


def errors_of_a_weak_mode() -> list[float]:
    """Error of a frequency at a tenth of the others' amplitude over that at the same amplitude, by the ledger."""
    values = ledger.claim("stand-equal-amplitudes").values
    return [values["a10"] / values["a100"]]


# ------------------------------------------------------------------------------------------------ wrapped rib


@functools.cache
def rib(name: str = "wrapped-rib", **changes: Any) -> Any:
    """A run of a rib; `__` stands for the dot of a key."""
    return evolvent.run(name, {key.replace("__", "."): value for key, value in changes.items()})


def strip() -> closed_forms.Strip:
    """The built-in rib."""
    return cases.load("wrapped-rib").strip


def stiffness_of_meshes() -> list[float]:
    """Bending stiffness of the paper's mesh on the hub, millions of the rib's, and error of the default mesh."""
    return [
        bending_stiffness_ratio(cases.load("wrapped-rib-paper")) / 1e6,
        bending_stiffness_ratio(cases.load("wrapped-rib")) - 1.0,
    ]


def peak_times() -> list[float]:
    """Times of the largest speed of the tip, s, for three dampings."""
    runs = [rib_runs.winding(**keys) for keys in rib_runs.of_the_paper()]
    return [float(run.t[run.peak]) for run in runs]


def taken_by_method(run: Any) -> float:
    """What the method takes at most, % of the largest energy or work."""
    scale = max(float(run.energy.max()), float(np.abs(run.work_loads).max()))
    return 100.0 * float(-run.energy_defect.min()) / scale


def at_rest() -> list[float]:
    """Force on the hub, N, its closed form, and the curvature's mean and scatter times R, as the table gives them."""
    run = rib("wrapped-rib-hold")
    rows = {number.label: number.value for number in cases.presenter(run).numbers(run)}
    force = rows["contact force, mean of the last 4 %"]
    mean, scatter = rows["curvature x R, away from the ends"].split(" ± ")
    closed = closed_forms.wound_contact_force(strip(), 0.2)
    return [float(force.partition(" N")[0]), closed, float(mean), float(scatter)]


def beyond_closed_form() -> list[float]:
    """How far the tip is beyond the closed form of deployment at three times, %."""
    run = rib("wrapped-rib-deploy").ev.regular()
    radius = run.tip_radius.sel(time=[1000.0, 4000.0, 8000.0]).values[:, 0]
    closed = [closed_forms.deployed_tip_radius(strip(), t) for t in (1000.0, 4000.0, 8000.0)]
    return [100.0 * (float(r) / float(c) - 1.0) for r, c in zip(radius, closed, strict=True)]


def deployment() -> list[float]:
    """What the method takes of the energy, %, and how far the tip is beyond the closed form at the end, %."""
    run = rib("wrapped-rib-deploy")
    tip = float(run.tip_radius[-1, 0]) / closed_forms.deployed_tip_radius(
        strip(), closed_forms.deployment_time(strip())
    )
    return [taken_by_method(run), 100.0 * (tip - 1.0)]


def with_turns() -> list[float]:
    """Forces on the hub with turns on one another and without, N, the closed form, and the change of the first, N.

    Without them it is that at 200 s.
    """
    fixed = {"rib__elements": 80, "solver__step": 0.5, "output__every": 2.0}
    ends = ((True, 1000.0), (False, 200.0))
    found = [rib("wrapped-rib-hold", **fixed, contact__self=layers, hold__time=end) for layers, end in ends]
    force = [run["contact-1"]["normal_force"].values for run in found]
    late = found[0].time.values >= 200.0
    return [force[0][-1], force[1][-1], closed_forms.wound_contact_force(strip(), 0.2), np.ptp(force[0][late])]


def of_the_lock() -> list[float]:
    """Energy of the paper's mesh on the hub, angle of the winding, its work by 0.2 N m, J, and the turns."""
    angle = strip().length / strip().radius
    ratio = bending_stiffness_ratio(cases.load("wrapped-rib-paper"))
    bending = ratio * closed_forms.bending_energy(strip())
    return [bending, ratio / 1e6, 0.2, angle, 0.2 * angle]


# ------------------------------------------------------------------------------------------------ the guide


def bounces(law: str, spectral_radius: float, steps: Sequence[float]) -> list[float]:
    """Restitution of a bar's end, by the number of steps in contact."""
    from energy.test_contact import CONTACT_TIME, bar, restitution, simulated

    return [
        restitution(simulated(bar(law), 0.8, CONTACT_TIME / count, spectral_radius=spectral_radius)) for count in steps
    ]


def slit_tube() -> list[float]:
    """Torsion constant of a closed tube over that of one that is slit."""
    closed = evolvent.Tube(radius=0.02, thickness=0.0002).properties(0.3)
    slit = evolvent.Arc(radius=0.02, angle=2.0 * math.pi, thickness=0.0002).properties(0.3)
    return [closed.J / slit.J]


# ----------------------------------------------------------------------------------------------- film blade


def stiff_strip() -> list[float]:
    """Largest rate of a stiff strip without tip mass on a light body, over r W and w W."""
    film, rotor = closed_forms.Film(0.02, 1e-9, 1e16, 0.3), closed_forms.Rotor(1e-8, 1e-6, 2, 1e-3, 0.0)
    spin = 1e-3 / float(closed_forms.rotor_inertia(rotor, 3.0))
    rate = closed_forms.payout_buckling_modes(film, rotor, 3.0, 1e-3)
    return [rate / (film.gyration * spin), rate / (film.width * spin)]


def held_film() -> list[float]:
    """Rate of a held root over w W0, and that of the case, mm/s, by the limit and by the closed form at 2 m."""
    case = cases.load("film-blade")
    whole = closed_forms.payout_buckling(case.film, case.rotor, 2.0, case.momentum, root="held")
    return [0.5 / math.sqrt(12.0), 0.5e3 * case.film.gyration * case.body.rate, 1e3 * whole]


def film_limits() -> list[float]:
    """Largest rates for all of the case's blade before it buckles and before an edge is slack, mm/s."""
    case = cases.load("film-blade")
    forms = (closed_forms.payout_buckling_modes, closed_forms.payout_slack)
    return [1e3 * form(case.film, case.rotor, case.payout.length, case.momentum) for form in forms]


# ------------------------------------------------------------------------------------------------ the table

STAND = ("docs/systems/inertia-stand.md",)
ACCURACY, PAGE, ENERGY = ("docs/accuracy.md",), ("docs/systems/wrapped-rib.md",), ("docs/theory/energy-momentum.md",)
PAPER = ("docs/theory/wrapped-rib-paper.md",)
FILM = ("docs/systems/film-blade.md",)
SENTENCES = (
    Sentence(r"free root: $v = {4.97}\,r W = {1.43}\,w W$, whatever", FILM, stiff_strip),
    Sentence(
        r"$v = r W_0/2 = {0.144}\,w W_0$ with the spin of the start, whatever the length, until the long wave decides. "
        "The paper's satellite: {23} mm/s, with $L_0$ and $GJ$ {25} mm/s.",
        FILM,
        held_film,
    ),
    Sentence(
        "lay {2.725} and {2.856} on the hub, the elastica {2.724} and {2.854}",
        ("docs/guide/rib-antennas.md",),
        lambda: [ledger.claim("rib-torque").values[name] for name in ("w_mean", "w_strong", "h_mean", "h_strong")],
    ),
    Sentence(
        "if its tail were straight along the tangent: {2.865} and {2.953} turns here",
        ("docs/guide/rib-antennas.md",),
        lambda: [ledger.claim("rib-torque").values[name] for name in ("n_mean", "n_strong")],
    ),
    Sentence(
        "For all 5 m the largest rate is {13.3} mm/s, in place of the paper's 35 mm/s; an edge is slack from {7.9} "
        "mm/s on.",
        FILM,
        film_limits,
    ),
    Sentence(
        "the lags differ by at most {0.15}°, the tension at the root by {0.4} %, the body's rate by {0.03} %.",
        FILM,
        lambda: [ledger.claim("thread-strip").values[name] for name in ("buckled", "tension", "rate")],
    ),
    Sentence("of 8 change the length by less than {<1} %.", FILM, held=f"{PAPERS}/film_blade/test_film_blade.py"),
    Sentence("off by up to {4.3} % (20 nodes) or {4.0} % (40 nodes)", ACCURACY, lambda: gaps("body_rate_paper")),
    Sentence(
        "the gap is up to {0.32} % (20 nodes) or {0.19} % (40 nodes)", ACCURACY, lambda: gaps("body_rate_corrected")
    ),
    Sentence("the body ends at 5.04 rad/s in place of {0.26}.", ACCURACY, end_rate),
    Sentence(
        "gains about {0.15} % over the whole deployment from nodes that had not been counted before, loses about "
        "{0.01} % by turning their velocity along the thread (eq. 12), and neglects {0.4} % that wound thread would",
        ACCURACY,
        momenta,
    ),
    Sentence("differs from that of an inextensible thread by {0.0015}° at 1e4 N/m", ACCURACY, off_by_springs),
    Sentence("as with 1e4 N/m, whose lag differs by {0.0015}°", ("docs/guide/speed.md",), off_by_springs),
    Sentence("by up to {0.31}° with 20 nodes, {0.05}° with 40 and {0.01}° with 80", ACCURACY, off_by_nodes),
    Sentence("The largest mean at the spool is {0.0168} N; the largest sample, {0.024} N,", ACCURACY, tensions),
    Sentence("between 1e-6 and 1 N s/m changes the lag by less than {<0.001}°", ACCURACY, off_by_damping),
    Sentence(
        "at {1.01} times the limit RK4 can run to the end", ACCURACY, held="tests/regression/test_unstable_step.py"
    ),
    Sentence(
        "{13} % of its area lies below 1 % of the energy at its middle. Loading the best of the four springs in place "
        "of always the same one lifts the least energy in the box, next to nothing on these curves and {3e-4} J at a "
        "corner, to {0.17} J",
        ACCURACY,
        least_energies,
    ),
    Sentence(
        "or away from it ({26} and {33} % of the points of",
        STAND,
        lambda: [ledger.claim("stand-safe-offset").values[name] for name in ("towards", "away")],
    ),
    Sentence("a mode of a tenth of the amplitude of the others has {65} times", STAND, errors_of_a_weak_mode),
    Sentence("and {0.07} % at the corners", ACCURACY, held="packages/evolvent-massprops/tests/stand/test_map.py"),
    Sentence(
        "its ten elements are {2.35} million times as stiff as the rib. Every run measures that ratio and warns; "
        "40 elements of the default `cable` are right to {<1e-4}",
        ACCURACY,
        stiffness_of_meshes,
    ),
    Sentence("the tip is fastest at {28.37}, {66.79} and {146.0} s for", ACCURACY, peak_times),
    Sentence(
        "Numerical damping takes {1} % of the energy, nearly all of it in the whip",
        ACCURACY,
        lambda: [taken_by_method(rib(solver__duration=80.0))],
    ),
    Sentence(
        "the forces sum to {3.341} N (T L / 2 R² = {3.333} N), curvature times R is {1.0037} ± {0.0017} as",
        ACCURACY,
        at_rest,
    ),
    Sentence(
        "the forces sum to {3.341} N ($TL/2R^2$ = {3.333} N), curvature times $R$ is {1.0037} ± {0.0017}, as",
        PAGE,
        at_rest,
    ),
    Sentence(
        "the tip is {0.9}, {0.7} and {0.6} % farther out than the closed form at 1000, 4000 and 8000 s",
        (*ACCURACY, *PAGE),
        beyond_closed_form,
    ),
    Sentence("the method takes {0.2 to 0.5} % of the energy", (*ACCURACY, *PAGE), lambda: deployment()[:1]),
    Sentence("near it the tail is bent, by {48} degrees", ACCURACY, lambda: [math.degrees(math.acos(2.0 / 3.0))]),
    Sentence(
        "ribs that mirror one another do so to {1e-8} m", (*ACCURACY, *PAGE), held=f"{PAPERS}/rib/test_simulate.py"
    ),
    Sentence(
        "It takes {13} J to lay the locked mesh on the hub, {2.35} million times as much as the rib; {0.2} N m over "
        "the {20} rad of the winding give {4} J",
        PAPER,
        of_the_lock,
    ),
    Sentence("The rib's length makes {3.18} turns", PAPER, lambda: [strip().length / strip().radius / (2.0 * math.pi)]),
    Sentence(
        "The force on the hub in hold is {3.3393} N (without turns on one another {3.3408} N; T L/2R^2 = {3.3333} "
        "N), and changes by less than {<1e-7} N from 200 s to 1000 s",
        ENERGY,
        with_turns,
    ),
    Sentence("at its tolerance of 3e-4 loses {0.2 to 0.5} % of its energy", ENERGY, lambda: deployment()[:1]),
    Sentence("The tip is {0.8} % beyond the closed form of a long tail", ENERGY, lambda: deployment()[1:]),
    Sentence(
        "{0.9998} at 20 steps in contact, {0.95} at 2, {0.88} at 1",
        ENERGY,
        lambda: bounces("conservative", 1.0 / 3.0, (20.0, 2.0, 1.0)),
    ),
    Sentence(
        "restitution is {0.9995} at 100 steps in contact, {0.992} at 10, {0.986} at 5, {0.58} at 2, {0.39} at 1, "
        "{0.13} at a third",
        ENERGY,
        lambda: bounces("hunt-crossley", 1.0, (100.0, 10.0, 5.0, 2.0, 1.0, 1.0 / 3.0)),
    ),
    Sentence("constant is about {30 000} times smaller than that", ("docs/guide/beams.md",), slit_tube),
)


def agrees_with(text: str, value: float) -> bool:
    """Whether a value rounds to a number with the digits of its text, or is in a range such as "0.2 to 0.5"."""
    least, to, most = text.partition(" to ")
    if to:
        return float(least) <= value <= float(most)
    plain = text.replace(" ", "")
    mantissa, _, power = plain.partition("e")
    decimals = len(mantissa.partition(".")[2])
    unit = 10.0 ** (int(power or 0) - decimals)
    if "." not in mantissa and not power and mantissa.endswith("0"):  # 30 000 has one digit that counts
        unit = 10.0 ** (len(mantissa) - len(mantissa.rstrip("0")))
    return abs(value - float(plain)) <= 0.5 * unit * (1.0 + 1e-9)


def text_of(file: str) -> str:
    """The words of a file, between single blanks."""
    return " ".join((ROOT / file).read_text(encoding="utf-8").split())


@pytest.mark.slow
@pytest.mark.digits
@pytest.mark.parametrize("one", SENTENCES, ids=lambda one: one.plain[:60])
def test_a_sentence_stands_in_its_files_and_its_numbers_are_right(one):
    for file in one.files:
        assert one.plain in text_of(file), f"{file} does not say: {one.plain}"
    stated = _NUMBER.findall(one.text)
    assert stated
    if one.numbers is None:
        source = (ROOT / one.held).read_text(encoding="utf-8")
        values = {node.value for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Constant)}
        for _, text in stated:
            assert float(text) in values or any(isinstance(v, str) and f"{text} %" in v for v in values), one.held
        return
    found = one.numbers()
    for (below, text), value in zip(stated, found, strict=True):
        agrees = abs(value) < float(text) if below else agrees_with(text, value)
        assert agrees, f"{text} is stated, {value:.6g} computed"


@pytest.mark.parametrize(
    ("text", "value", "agrees"),
    [
        ("4.3", 4.28, True), ("4.3", 4.36, False), ("3e-4", 3.3e-4, True), ("3e-4", 3.6e-4, False), ("13", 13.2, True),
        ("30 000", 29_900.0, True), ("30 000", 36_000.0, False), ("20", 20.4, True), ("1.2e-3", 1.26e-3, False),
        ("0.2 to 0.5", 0.2, True), ("0.2 to 0.5", 0.51, False),
    ],
)  # fmt: skip
def test_rounding(text, value, agrees):
    assert agrees_with(text, value) is agrees
