"""The paper's heliogyro against its reference results (shared/models/thread.md, "Reference results")."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from book import Book
from evolvent import model as mdl
from helpers import END, L0, RHO, TIP, W0, J, L, Run, V, heliogyro, run

TIMES = np.arange(0.0, END, 0.05)
#: Mean tip lag of the limit of many nodes, degrees, over windows of time, s.
WINDOWS = ((7.0, 20.0), (20.0, 60.0), (60.0, 100.0), (100.0, 142.0))
MEANS = (13.46, 13.32, 12.94, 12.3)


@functools.cache
def deployment(nodes: int) -> Run:
    return run(heliogyro(nodes=nodes), TIMES)


@functools.cache
def springs(stiffness: float, turn: bool) -> Run:
    """The same on springs."""
    return run(heliogyro(segments="springs", stiffness=stiffness, rotate_velocity=turn), TIMES, "rk4")


def means(lag: np.ndarray) -> list[float]:
    return [float(lag[(TIMES >= a) & (TIMES <= b)].mean()) for a, b in WINDOWS]


def formulas(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Body rate by the paper's (18) and by the formula with L0, both from the body's momentum J W0 alone."""
    x = V * t
    paper = J * W0 / (J + 2.0 / 3.0 * RHO * x**3 + 2.0 * TIP * x**2)
    corrected = J * W0 / (J + 2.0 * RHO * ((L0 + x) ** 3 - L0**3) / 3.0 + 2.0 * TIP * (L0 + x) ** 2)
    return paper, corrected


@pytest.mark.slow
@pytest.mark.parametrize("nodes", [20, 40, 80])
def test_mean_tip_lag(nodes: int, book: Book) -> None:
    """Mean lags 13.46, 13.32, 12.94, 12.3 deg (thread.md): their last digit at n >= 40; 0.06 deg below at n = 20.

    At n = 20 the blade, each of whose last nodes is 5 % of it, swings by 0.3 deg more at the end of the deployment.
    """
    tolerance = [0.005, 0.005, 0.01, 0.06] if nodes == 20 else [0.005, 0.005, 0.01, 0.05]
    assert np.all(np.abs(np.array(means(deployment(nodes).lag())) - MEANS) < tolerance)
    book(
        "Threads, reels, tethers", f"Heliogyro, mean tip lags in four windows ({nodes} nodes)",
        reference="13.46, 13.32, 12.94, 12.3 deg", source="independent computation",
        error=np.abs(np.array(means(deployment(nodes).lag())) - MEANS).max(), allowed=max(tolerance), unit="deg",
    )  # fmt: skip


def test_first_extremes_of_the_tip_lag(book: Book) -> None:
    """15.26 deg at 0.13 s, 12.62 at 0.35 s, 14.02 at 0.67 s (thread.md): n = 40, to the last digits given."""
    t = np.arange(0.0, 1.0, 0.002)
    lag = run(heliogyro(nodes=40), t, rtol=1e-10, atol=1e-12).lag()[1:]
    turns = np.flatnonzero(np.diff(np.sign(np.diff(lag)))) + 1
    assert t[1:][turns] == pytest.approx([0.13, 0.35, 0.67], abs=0.005)
    assert lag[turns] == pytest.approx([15.26, 12.62, 14.02], abs=0.006)
    book(
        "Threads, reels, tethers", "Heliogyro, first extremes of the tip lag (40 nodes)",
        reference="15.26, 12.62, 14.02 deg", source="independent computation",
        error=np.abs(lag[turns] - [15.26, 12.62, 14.02]).max(), allowed=0.006, unit="deg",
    )  # fmt: skip


def test_end_rate() -> None:
    """The body ends at about 0.26 rad/s (thread.md)."""
    assert deployment(20).rate()[-1] == pytest.approx(0.26, abs=0.001)


@pytest.mark.parametrize(("nodes", "gap"), [(20, 4.28), (40, 4.00)])
def test_gap_to_the_papers_formula(nodes: int, gap: float) -> None:
    """Largest gap of W to (18), relative to W, over the whole deployment: 4.28 % (n = 20), 4.00 % (n = 40)."""
    rate = deployment(nodes).rate()
    assert 100.0 * np.max(np.abs(rate - formulas(TIMES)[0]) / rate) == pytest.approx(gap, abs=0.006)


@pytest.mark.parametrize(("nodes", "body_alone", "with_tip"), [(20, 0.384, 0.322), (40, 0.250, 0.188)])
def test_gap_to_the_corrected_formula(nodes: int, body_alone: float, with_tip: float) -> None:
    """Largest gap of W to the formula with L0, relative to W, over the whole deployment.

    thread.md gives 0.52 / 0.19 % for n = 20 / 40. From the momentum (J + 2 m_k L0^2) W0, the tip masses turning with
    the body at the start, it is 0.32 / 0.19 %; from J W0 alone 0.38 / 0.25 %. The 0.52 % has not been found under any
    definition tried (relative to W, to the formula, to W0; with the whole blade's momentum 0.63 / 0.46 %).
    """
    rate, formula = deployment(nodes).rate(), formulas(TIMES)[1]
    assert 100.0 * np.max(np.abs(rate - formula) / rate) == pytest.approx(body_alone, abs=0.002)
    formula = formula * (1.0 + 2.0 * TIP * L0**2 / J)
    assert 100.0 * np.max(np.abs(rate - formula) / rate) == pytest.approx(with_tip, abs=0.002)


def test_energy_and_hub_tension() -> None:
    """Energy 0.0720 -> 0.0031 J, the spools absorb 0.069 J, hub tension peaks at 0.0168 N at 29.5 s (thread.md).

    The peak is flat and carries the swing of the nodes: 0.0167 N within half a second of 29.5 s, n = 40.
    """
    seen = deployment(40)
    assert 0.5 * J * W0**2 == pytest.approx(0.0720)
    assert seen.energy[0] == pytest.approx(0.0720, abs=1e-4)
    assert seen.energy[-1] == pytest.approx(0.0031, abs=5e-5)
    assert -seen.accounts[-1, mdl.SPOOL] == pytest.approx(0.069, abs=5e-5)
    hub = np.array([row[count - 1] for row, count in zip(seen.seen.tension, seen.solution.s[:, 0], strict=True)])
    assert hub.max() == pytest.approx(0.0168, abs=1e-4)
    assert TIMES[hub.argmax()] == pytest.approx(29.5, abs=0.5)


@pytest.mark.slow
def test_springs_at_1e7_are_inextensible_from_the_start() -> None:
    """c = 1e7, n = 20 against rigid segments, 5 s of deployment: rate to 1e-5, lag to 0.01 deg after 1 s (issue 2)."""
    t = np.arange(0.0, 5.0, 0.02)
    rigid = run(heliogyro(), t, rtol=1e-10, atol=1e-12)
    springs = run(heliogyro(segments="springs", stiffness=1e7), t, "rk4")
    assert np.max(np.abs(springs.rate() - rigid.rate()) / rigid.rate()) < 1e-5
    assert np.max(np.abs(springs.lag() - rigid.lag())[t >= 1.0]) < 0.01


@pytest.mark.slow
def test_springs_at_1e7_are_inextensible_farther_out() -> None:
    """As above from 3 m out, through a release: rate to 1e-5, lag to 0.01 deg (issue 2)."""
    t = np.arange(0.0, 4.0, 0.05)
    given = {"out": 3.2, "rate": 1.0}
    rigid = run(heliogyro(**given), t, rtol=1e-10, atol=1e-12)
    springs = run(heliogyro(segments="springs", stiffness=1e7, **given), t, "rk4")
    assert rigid.solution.s[-1, 0] == rigid.solution.s[0, 0] + 1
    assert np.max(np.abs(springs.rate() - rigid.rate()) / rigid.rate()) < 1e-5
    assert np.max(np.abs(springs.lag() - rigid.lag())[t >= 1.0]) < 0.01


@pytest.mark.slow
@pytest.mark.parametrize(
    ("stiffness", "difference", "tolerance"),
    [(1e2, 0.15, 0.02), pytest.param(1e3, 0.016, 0.003, marks=pytest.mark.release), (1e4, 0.0016, 0.001)],
)
def test_stiffness_hardly_matters(stiffness: float, difference: float, tolerance: float) -> None:
    """Lag from its rigid limit 0.15, 0.016, 0.0016 deg at c = 1e2, 1e3, 1e4 (thread.md); 1e4 within 0.005 (issue 2).

    The largest difference after 7 s, when the start's swing has gone, over the whole deployment, n = 20.
    """
    later = TIMES >= 7.0
    off = np.abs(springs(stiffness, True).lag() - deployment(20).lag())
    largest = np.max(off[later])
    assert largest == pytest.approx(difference, abs=tolerance)
    if stiffness == 1e4:
        after_first_second = TIMES >= 1.0
        assert np.max(off[after_first_second]) < 0.005


@pytest.mark.slow
def test_damping_hardly_matters() -> None:
    """d between 1e-6 and 1 N s/m changes the lag by less than 0.002 deg (thread.md): c = 1e4, [20, 60] s, mean."""
    t = np.arange(0.0, 60.0, 0.05)
    runs = [run(heliogyro(segments="springs", damping=d), t, "rk4") for d in (1e-6, 1e-1)]
    lags = [one.lag()[: t.size][t >= 20.0].mean() for one in (*runs, springs(1e4, True))]  # 1e-3 unless given
    assert np.ptp(lags) < 0.002


@pytest.mark.slow
def test_the_rotation_of_velocities_hardly_matters() -> None:
    """Leaving (12) out changes the mean lag by less than 0.006 deg (thread.md); c = 1e4.

    So it does up to 100 s, by 0.0003 deg up to 60 s; by 0.007 deg in the last window.
    """
    differences = np.abs(np.subtract(*(means(springs(1e4, turn).lag()) for turn in (True, False))))
    assert np.all(differences < [0.0005, 0.0005, 0.006, 0.008])


def test_start_is_all_wound() -> None:
    """Eq. 17: at the start node 1 is the boundary node at Q, the others are on the spool; L = 5 m."""
    assembly = heliogyro()
    seen = run(assembly, [0.0, 1e-6])
    x = seen.in_body(seen.seen.position)[0] - np.array([L0, 0.0, 0.0])
    turn = -np.arange(20) * (L / 20) / 0.01
    assert x == pytest.approx(np.array([0.01 * np.sin(turn), 0.0 * turn, 0.01 * np.cos(turn)]).T, abs=1e-12)
