"""Distances of points from boxes, their secants, and the fading of edges, against sampling and differences."""

from __future__ import annotations

import numpy as np
import pytest

from evolvent.kernels import body_gaps

SIDES = np.array([0.3, 0.2, 0.1])


def test_distance_of_a_point_from_a_box(rng: np.random.Generator) -> None:
    """That to the nearest point of the box outside, to the nearest face inside; the gradient is its derivative."""
    for p in rng.uniform(-0.6, 0.6, (200, 3)):
        found = np.array(body_gaps.box_distance(*p, *SIDES))
        outside = np.linalg.norm(p - np.clip(p, -SIDES, SIDES))
        assert found[0] == pytest.approx(outside if outside > 0.0 else -np.min(SIDES - np.abs(p)), abs=1e-15)
        assert np.linalg.norm(found[1:]) == pytest.approx(1.0)
        h = 1e-7 * np.eye(3)
        slope = [(body_gaps.box_distance(*(p + e), *SIDES)[0] - body_gaps.box_distance(*(p - e), *SIDES)[0]) for e in h]
        np.testing.assert_allclose(np.array(slope) / 2e-7, found[1:], atol=1e-6)


def test_secant_of_a_step_does_the_work_of_the_change(rng: np.random.Generator) -> None:
    """From outside, inside and through the surface, of steps of any size."""
    for size in (1e-12, 1e-6, 1e-2, 0.3):
        for p in rng.uniform(-0.5, 0.5, (100, 3)):
            q = p + size * rng.standard_normal(3)
            before, after = (body_gaps.box_distance(*x, *SIDES)[0] for x in (p, q))
            secant = np.array(body_gaps.box_secant(*p, *q, *SIDES, before, after))
            assert secant @ (q - p) == pytest.approx(after - before, abs=1e-15)


def test_edges_fade_as_they_become_parallel() -> None:
    assert body_gaps.fade(1.0, 0.01) == pytest.approx(0.01)
    assert body_gaps.fade(np.cos(np.radians(11.0)), 0.01) == 0.0
    for w in (0.99, -0.995):
        slope = (body_gaps.fade(w + 1e-6, 0.01) - body_gaps.fade(w - 1e-6, 0.01)) / 2e-6
        assert body_gaps.fade_slope(w, w, 0.01) == pytest.approx(slope, rel=1e-6)
        change = body_gaps.fade_slope(w, 0.9, 0.01) * (0.9 - w)
        assert change == pytest.approx(body_gaps.fade(0.9, 0.01) - body_gaps.fade(w, 0.01))


@pytest.mark.parametrize(
    ("v", "crosses"), [((0.0, 0.0, -0.5), True), ((0.0, 0.0, 0.2), False), ((0.9, 0.0, 0.5), False)]
)
def test_ways_through_a_box(v: tuple, crosses: bool) -> None:
    found = getattr(body_gaps.crosses_box, "py_func", body_gaps.crosses_box)((0.0, 0.0, 0.5), v, SIDES, 0.05)
    assert found == crosses
