"""Predicted swings of measured pendulums: the model against the equations of motion by SciPy, and the verdict."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from evolvent import laboratory
from evolvent.base.errors import InputError
from evolvent.laboratory import book, pendulum


def reference(model: pendulum.Pendulum, piece: pendulum.Piece) -> np.ndarray:
    """Angles of a pendulum of any number of arms by Lagrange's equations in absolute angles, rad."""
    n, m, g = model.arms, np.array(model.masses), model.gravity
    reach = np.zeros((n, n))  # of the centre of mass k along arm i
    for k in range(n):
        reach[k, :k] = model.lengths[:k]
        reach[k, k] = model.centres[k]
    W = np.einsum("k,ki,kj->ij", m, reach, reach)
    pull = np.einsum("k,ki->i", m, reach) * g
    D = np.zeros((n, n))
    for k, friction in enumerate(model.frictions):
        e = np.zeros(n)
        e[k] = 1.0
        if k:
            e[k - 1] = -1.0
        D += friction * np.outer(e, e)

    def rates(_: float, y: np.ndarray) -> np.ndarray:
        angle, rate = y[:n], y[n:]
        apart = angle[:, None] - angle[None, :]
        M = W * np.cos(apart) + np.diag(model.inertias)
        force = pull * np.sin(angle) - (W * np.sin(apart)) @ rate**2 - D @ rate
        return np.concatenate([rate, np.linalg.solve(M, force)])

    start = np.concatenate([piece.angles[0], piece.rates[0]])
    found = solve_ivp(rates, (0.0, piece.time[-1]), start, t_eval=piece.time, rtol=1e-9, atol=1e-11)
    return np.asarray(found.y[:n].T)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(pendulum.AUTHORS))
def test_predictions_are_those_of_the_equations_of_motion(name: str) -> None:
    piece = pendulum.pieces_of(name, None, 1)[0]
    model = pendulum.AUTHORS[name]
    expected = reference(model, piece)
    np.testing.assert_allclose(model.predicted(piece, tolerance=1e-9), expected, atol=2e-5)
    np.testing.assert_allclose(model.predicted(piece), expected, atol=2e-3)


@pytest.mark.slow
def test_a_fit_predicts_the_other_pieces() -> None:
    """Three pieces of the triple pendulum: the median is within its band, and below 0.006 rad."""
    found = laboratory.found("triple-pendulum").validate({"pieces": 4, "fitted": 1})
    assert [one.what.split()[0] for one in found.comparisons] == ["median", "largest", "median", "largest"]
    assert found.comparisons[0].covered
    assert 0.001 < found.comparisons[0].predicted < 0.006
    assert 0.001 < found.comparisons[2].predicted < 0.02
    assert "3 pieces" in found.comparisons[0].what
    assert any("fitted to 1 pieces" in note for note in found.notes)
    assert len(found.figures[0].panels) == 4


def test_pieces_are_those_of_the_package_or_of_a_folder(tmp_path) -> None:
    assert len(pendulum.pieces_of("double-pendulum", None, 1000)) == 26
    assert len(pendulum.pieces_of("triple-pendulum", None, 1000)) == 22
    with pytest.raises(
        InputError, match=r"has no CSV file whose first line is time_s,angle1_rad,angle2_rad,rate1_rad_s"
    ):
        pendulum.pieces_of("double-pendulum", str(tmp_path), 10)
    with pytest.raises(InputError, match=r"is not a folder with CSV files"):
        pendulum.pieces_of("double-pendulum", str(tmp_path / "none"), 10)
    head = "time_s,angle1_rad,angle2_rad,rate1_rad_s,rate2_rad_s"
    (tmp_path / "a.csv").write_text(f"{head}\n1,3,3,0,0\n1.5,3.1,3.1,0.1,0.1\n2,3.2,3.2,0,0\n")
    found = pendulum.pieces_of("double-pendulum", str(tmp_path), 10)
    assert (found[0].name, found[0].every, found[0].time[-1]) == ("a.csv", 0.5, 1.0)
    (tmp_path / "a.csv").write_text(f"{head}\n1,3,x,0,0\n")
    with pytest.raises(InputError, match=r"a\.csv: it is no table of numbers"):
        pendulum.pieces_of("double-pendulum", str(tmp_path), 10)
    (tmp_path / "a.csv").write_text(f"{head}\n1,3,3,0,0\n")
    with pytest.raises(InputError, match=r"a\.csv: it needs two rows of finite numbers"):
        pendulum.pieces_of("double-pendulum", str(tmp_path), 10)


def test_bands_and_verdicts() -> None:
    band = book.Band(measurement=0.3, parameters=0.4, numerics=0.0)
    assert band.half_width == pytest.approx(1.96 * 0.5)
    inside = book.Comparison(what="a", unit="Hz", predicted=10.5, measured=10.0, band=band, allowed=0.4, goal="4 %")
    outside = book.Comparison(what="b", unit="Hz", predicted=12.0, measured=10.0, band=band)
    verdict = book.Verdict(comparisons=(inside, outside), figures=())
    assert (inside.covered, inside.meets, outside.covered, outside.meets) == (True, False, False, True)
    assert verdict.coverage == (1, 2)
    assert verdict.missed == [inside]
    assert verdict.text == "0 of 1 goals are met; 1 of 2 differences are within their bands of 95 %"
    assert book.rows(verdict)[1][-1] == "MISSED, within"
    assert math.isnan(outside.allowed)


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["tripel-pendulum"], "no set of measurements is called 'tripel-pendulum'; did you mean 'triple-pendulum'?"),
        (["triple-pendulum", "--set", "fited=2"], "unknown key 'fited'; did you mean 'fitted'?"),
        (["triple-pendulum", "--set", "fitted=-2"], "fitted is -2"),
        (["triple-pendulum", "--data", "none"], "'none' is not a folder with CSV files"),
        (["triple-pendulum", "--figure", "a.txt"], "a.txt"),
        (["--set", "fitted=2"], "a SET is missing; known: double-pendulum, triple-pendulum, wing-spar"),
    ],
)
def test_what_cannot_be_validated_is_refused(call, words, sentence) -> None:
    code, out, err = call("validate", *words)
    assert (code, out) == (2, "")
    assert sentence in err
    assert err.count("\n") == 1


def test_sets_are_listed(call) -> None:
    code, out, _ = call("validate")
    assert code == 0
    assert [line.split()[0] for line in out.splitlines()] == list(laboratory.SETS)


@pytest.mark.slow
def test_the_command_writes_a_verdict(call, tmp_path) -> None:
    words = ["triple-pendulum", "--set", "pieces=2", "--set", "fitted=0", "-o", "v.json", "--figure", "v.png"]
    code, out, err = call("validate", *words)
    assert (code, err) == (0, "")
    assert "2 of 2 differences are within their bands of 95 %" in out
    assert {one.name for one in tmp_path.iterdir()} == {"v.json", "v.png"}
