"""Wire booms: runs against straight wires and an independent continuum, modes against closed forms, logs."""

from __future__ import annotations

import csv
import dataclasses
import functools
import pathlib
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.polynomial import legendre
from scipy.integrate import solve_ivp

import evolvent
from book import Book
from evolvent import cases
from evolvent.design import calibration
from evolvent_base.errors import InputError
from evolvent_papers.wire_booms import SYSTEM, Case, closed_form, deployed, log, pendulum_rates
from evolvent_papers.wire_booms.structure import angular_momenta, inertia, lengths_at, timeline

LOG = pathlib.Path(log.__file__).with_name("rbsp-a.csv")
#: Half a metre of the pair 1-2 from 10.15 m, then a quarter of the other, at the speed of the flight.
SHORT = {
    "groups": [[["1-2", 10.15, 10.65, 90.0], ["3-4", 10.15, 10.4, 50.0]]],
    "rates": [1.49], "start_lengths": [10.15], "timing.ramp": 15.0, "timing.pause": 10.0, "wire.stiffness": 1e6,
}  # fmt: skip


@functools.cache
def short(nodes: int) -> Any:
    return evolvent.run("wire-booms", SHORT | {"wire.nodes": nodes, "solver.tolerance": 1e-6})


@dataclasses.dataclass(frozen=True)
class Continuum:
    """Two pairs of wires as growing continua (shared/models/thread.md, "Continuum with continuous mass injection")."""

    case: Case
    modes: int = 2

    def matrices(self) -> tuple[np.ndarray, ...]:
        """Points, weights, integrals to the points, and polynomials with two derivatives there, of 0 <= xi <= 1."""
        nodes, weights = legendre.leggauss(12)
        xi = 0.5 * (nodes + 1.0)
        back = np.linalg.inv(legendre.legvander(nodes, 11))
        first = np.array([legendre.legint(row, lbnd=-1.0) for row in np.eye(12)])
        to_points = 0.5 * legendre.legval(nodes, first.T).T @ back
        shapes = [
            np.array([legendre.legval(at, legendre.legder(row, k)) * 2.0**k for row in np.eye(self.modes)])
            for k in (0, 1, 2)
            for at in (np.append(np.append(-1.0, nodes), 1.0),)
        ]
        return xi, 0.5 * weights, to_points, *shapes

    def solve(self, length: Callable[[int, float], tuple[float, float, float]], times: np.ndarray) -> np.ndarray:
        """Spin rate at times, (nt,), rad/s; length: of a pair and a time its length and two derivatives."""
        case, K = self.case, self.modes
        xi, weight, to_points, P, P1, P2 = self.matrices()
        wire, R = case.wire, case.body.root
        inner = P[:, 1:-1]

        def rows(t: float, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
            """Residuals (m, n) of the equations with accelerations a (m, n)."""
            psi, psi1, psi2 = q[-1], v[-1], a[:, -1:]
            e, d = np.array([np.cos(psi), np.sin(psi)]), np.array([-np.sin(psi), np.cos(psi)])
            found, total = [], float(case.body.inertia) * psi2[:, 0]
            for p in range(2):
                own = slice(p * K, p * K + K)
                length_, speed, change = length(p, t)
                rate = speed / length_
                f, f1, f2 = q[own] @ P, q[own] @ P1, q[own] @ P2
                g, g1 = v[own] @ P, v[own] @ P1
                s = 1.0 - np.concatenate([[0.0], xi, [1.0]])
                w = g + rate * s * f1
                Dw = (
                    a[:, own] @ P + 2 * rate * s * g1 + (rate * s) ** 2 * f2 + (change / length_ - 2 * rate**2) * s * f1
                )
                along = np.array([np.cos(f), np.sin(f)])
                across = np.array([-np.sin(f), np.cos(f)])
                inside = across * Dw[:, None, :] - along * w**2
                A0 = R * (psi2 * d - psi1**2 * e) + change * along[:, 0]
                A0 = A0 + speed * (2 * g[0] + rate * f1[0]) * across[:, 0]
                A = A0[:, :, None] + length_ * inside[:, :, 1:-1] @ to_points.T
                tip = A0 + length_ * inside[:, :, 1:-1] @ weight
                bent = inner[:, None, :] * across[None, :, 1:-1]
                Phi, end = length_ * bent @ to_points.T, length_ * bent @ weight
                force = wire.line_density * length_ * (A @ weight) + wire.tip_mass * tip
                load = wire.line_density * length_ * np.tensordot(A * weight, Phi, axes=([1, 2], [1, 2]))
                found.append(load + wire.tip_mass * tip @ end.T)
                wound = wire.line_density * (wire.length - length_) * R**2 * psi2[:, 0]
                total = total + 2.0 * (wound + R * force @ d + wire.line_density * speed**2 * R * np.sin(f[0] - psi))
            return np.concatenate([*found, total[:, None]], axis=1)

        n = 2 * K + 1
        trials = np.vstack([np.zeros(n), np.eye(n)])

        def rates(t: float, y: np.ndarray) -> np.ndarray:
            q, v = y[:n], y[n:]
            found = rows(t, q, v, trials)
            return np.concatenate([v, np.linalg.solve((found[1:] - found[0]).T, -found[0])])

        start = np.zeros(2 * n)
        start[[n, n + K, -1]] = case.rates[0]
        found = solve_ivp(rates, (0.0, times[-1]), start, method="DOP853", t_eval=times, rtol=1e-6, atol=1e-8)
        return np.asarray(found.y[-1])


def lengths_and_rates(case: Case) -> Callable[[int, float], tuple[float, float, float]]:
    """Length of a pair and its derivatives, by differences of the closed form."""
    h = 0.05

    @functools.lru_cache(maxsize=1)
    def lengths(t: float) -> np.ndarray:
        return lengths_at(case, np.array([t - h, t, t + h]))

    def found(p: int, t: float) -> tuple[float, float, float]:
        x = lengths(t)[:, p]
        return float(x[1]), float(x[2] - x[0]) / (2 * h), float(x[2] - 2 * x[1] + x[0]) / h**2

    return found


@pytest.mark.slow
def test_a_run_is_a_growing_continuum_and_that_is_nearly_straight(book: Book) -> None:
    """170 s of the flight's second group: lumped wires, a continuum that grows, and straight wires."""
    case = cases.load("wire-booms", SHORT)
    t = short(20).time.values
    continuous = Continuum(case).solve(lengths_and_rates(case), t)
    straight = closed_form(case, t)["spin_rate"]
    change = straight[0] - straight[-1]
    coarse, fine = (float(np.abs(short(n).spin_rate.values - continuous).max()) / change for n in (10, 40))
    book(
        "Threads, reels, tethers", "wire booms of a spacecraft in spin, change of the spin rate [40 nodes]",
        reference="continuum of two pairs, 2 Legendre modes each", source="shared/models/thread.md", error=fine,
        allowed=4e-3,
    )  # fmt: skip
    assert fine < 0.5 * coarse
    # the swing of the wires, which straight wires lack, is in both
    assert float(np.abs(continuous - straight).max()) / change == pytest.approx(0.012, abs=0.004)
    assert float(np.abs(short(40).spin_rate.values - straight).max()) / change > 3.0 * fine


def test_momentum_of_a_run_is_kept() -> None:
    found = short(20)
    momentum = found.angular_momentum.values[:, 2]
    assert momentum[0] == pytest.approx(float(angular_momenta(cases.load("wire-booms", SHORT))[0]), rel=2e-3)
    np.testing.assert_allclose(momentum, momentum[0], rtol=3e-5)


def test_modes_of_the_deployed_booms(book: Book) -> None:
    """In the plane two and two against each other, out of it, and all together against the hub."""
    case = cases.load("wire-booms")
    end = np.array([timeline(case).end])
    lengths, (_, spin) = lengths_at(case, end), deployed(case)
    in_plane, out_of_plane = (found[0, 0] for found in pendulum_rates(case, lengths, np.array([spin])))
    wire, R, length = case.wire, case.body.root, lengths[0, 0]
    mass = wire.line_density * length + wire.tip_mass
    first = wire.line_density * length**2 / 2.0 + wire.tip_mass * length
    second = wire.line_density * length**3 / 3.0 + wire.tip_mass * length**2
    hub = float(case.body.inertia) / 4.0 + mass * R**2
    together = spin * np.sqrt(R * first * (hub + second + 2.0 * R * first) / (second * hub - (R * first) ** 2))
    found = np.abs(SYSTEM.modes(case).pole.imag)
    for name, value in (("in plane", in_plane), ("out of plane", out_of_plane), ("all against the hub", together)):
        error = float(np.abs(found - value).min()) / value
        book(
            "Modes", f"pendulum modes of four wire booms, {name} [12 cable elements]", reference="rigid pendulums",
            source="W. Johnson, Helicopter Theory, 1980", error=error, allowed=1e-3,
        )  # fmt: skip
    assert in_plane / spin == pytest.approx(np.sqrt(R / length), rel=0.25)  # hub radius over length


def test_the_formula_with_roots_on_the_axis_is_eq_18() -> None:
    """J W0 / (J + 2/3 rho l^3 + 2 m l^2) of two blades is that of each pair of booms."""
    case = cases.load("wire-booms")
    lengths = np.array([10.0, 20.0])
    wire, own = case.wire, float(case.body.inertia)
    eq_18 = own + np.sum(2.0 / 3.0 * wire.line_density * lengths**3 + 2.0 * wire.tip_mass * lengths**2)
    assert inertia(case, lengths, root=0.0) == pytest.approx(eq_18, rel=1e-12)


#: The log in the files of other programs.
LOG_DIALECTS = {
    "semicolons": lambda text: text.replace(",", ";"),
    "decimal commas": lambda text: text.replace(",", "\t").replace(".", ","),
    "units": lambda text: text.replace("_before_m", "_before [m]").replace("_rpm", " (U/min)"),
    "more columns": lambda text: "\n".join(f"{row},{'ok' if k else 'state'}," for k, row in enumerate(text.split())),
}


@pytest.mark.parametrize("dialect", LOG_DIALECTS)
def test_a_log_of_any_program_is_the_same(tmp_path: pathlib.Path, dialect: str) -> None:
    path = tmp_path / "log.csv"
    path.write_text(LOG_DIALECTS[dialect](LOG.read_text(encoding="utf-8")), encoding="utf-16")
    assert log.is_log(str(path))
    rows, notes = log.read(str(path))
    assert (rows, notes) == log.read(str(LOG))
    path.write_text(log.written(rows), encoding="utf-8")
    assert log.read(str(path)) == (rows, [])


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("7.04", "7.o4", "line 2 holds '7.o4' in column 'rate_before', where a number must be"),
        (",0.0,4.0", ",-1,4.0", "row 1 of '.*' has a stroke of -1 m; it must be 0 m or more"),
        (",0.0,4.0", ",,4.0", "row 1 of '.*' has no stroke; it must be 0 m or more"),
        ("rate_before_rpm", "rate_before_mm", "the column 'rate_before_mm' of '.*': 'mm' is a unit of something else"),
        ("rate_before_rpm", "rate", "has no column 'rate_before_rpm'; a log of wire booms has pair, start_utc"),
        ("2012-09-13T19:44:10", "yesterday", "row 1 of '.*' has a time that is not of the form 2012-09-13T19:44:10"),
        ("3-4,2012-09-13", "5-6,2012-09-13", "row 2 of '.*' has the pair '5-6'; it must be one of 1-2, 3-4"),
    ],
)
def test_a_log_that_cannot_be_read_is_refused(tmp_path: pathlib.Path, old: str, new: str, sentence: str) -> None:
    path = tmp_path / "log.csv"
    path.write_text(LOG.read_text(encoding="utf-8").replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InputError, match=sentence):
        log.read(str(path))


@pytest.mark.slow
@pytest.mark.parametrize("slip", ["times", "rates", "pair", "length"])
def test_a_log_with_slips_is_read_and_noted(tmp_path: pathlib.Path, slip: str) -> None:
    """Rows without a rate, with times in the wrong order, another form of the pair, and a longer wire."""
    rows = list(csv.reader(LOG.read_text(encoding="utf-8").splitlines()))
    if slip == "times":
        rows[5][1], rows[5][2] = rows[5][2], rows[5][1]
    elif slip == "rates":
        rows[4][7] = ""  # the last one before a spin-up
    elif slip == "pair":
        rows[3][0] = "1/2"
    else:
        rows[-1][4] = "49.3"
    path = tmp_path / "log.csv"
    path.write_text("\n".join(",".join(row) for row in rows), encoding="utf-8")
    fit = ["wire.tip_mass,wire.line_density,start_lengths.1,rates"]
    found = calibration.calibrate("wire-booms", str(path), fit=fit, observe=["spin_rate"])
    assert found.rms < 0.010
    assert found.values[2] == pytest.approx(10.1, abs=0.3)
    assert found.residuals.size == 23 - (slip == "rates")
    text = " ".join(found.notes)
    assert ("Row 5 of the log ends at" in text) == (slip == "times")
    assert ("wire.length is set to" in text) == (slip == "length")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"rates": [1.0]}, r"rates has 1 entries; it must have one for each of the 3 groups"),
        ({"groups": []}, "groups holds no step"),
        ({"wire.length": "40 m"}, r"groups.2 has a boom of 45 m; its length must be from 0 m to wire.length, 40 m"),
    ],
)
def test_cases_that_contradict_themselves_are_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        cases.load("wire-booms", changes)
