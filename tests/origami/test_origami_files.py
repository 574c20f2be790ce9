"""Crease patterns in files of FOLD: what is read, what is refused, and the folded states that they have."""

from __future__ import annotations

import json
import pathlib
from typing import Any

import numpy as np
import pytest

from evolvent.elements import fold_files
from evolvent.families.origami.folding import Loops
from evolvent_base.errors import InputError

ANGLE = np.radians(60.0)


def miura(tmp_path: pathlib.Path, facets: tuple[int, int] = (4, 3)) -> pathlib.Path:
    path = tmp_path / "sheet.fold"
    fold_files.write_miura(str(path), facets=facets, sides=(0.2, 0.3), angle=60.0)
    return path


def changed(path: pathlib.Path, **keys: Any) -> pathlib.Path:
    """The file with other values of some keys; None leaves a key out."""
    content = json.loads(path.read_text("utf-8")) | keys
    path.write_text(json.dumps({key: value for key, value in content.items() if value is not None}), "utf-8")
    return path


def loops(path: pathlib.Path) -> Loops:
    return Loops(path.name, fold_files.read(str(path), path.read_text("utf-8")))


def is_zigzag(crease: fold_files.Crease) -> bool:
    return abs(crease.begin - crease.end) == 1


def test_facets_follow_from_edges(tmp_path: pathlib.Path) -> None:
    """Without faces_vertices facets are what the edges enclose, each counterclockwise."""
    path = miura(tmp_path)
    stated = fold_files.read(str(path), "stated").facets
    found = fold_files.read(str(changed(path, faces_vertices=None)), "found").facets
    assert {frozenset(one) for one in found} == {frozenset(one) for one in stated}
    assert {len(one) for one in found} == {4}


@pytest.mark.parametrize("largest", [5.0, 60.0, 120.0, 170.0])
def test_miura_folds_by_its_closed_form(tmp_path: pathlib.Path, largest: float) -> None:
    """Tangents of half the fold angles of both classes of creases have the ratio cos(angle), and signs as assigned."""
    own = loops(miura(tmp_path))
    angles = own.folded(np.radians(largest)).angles
    zigzag = np.array([is_zigzag(one) for one in own.pattern.creases])
    assert np.abs(angles[zigzag]) == pytest.approx(np.radians(largest), abs=1e-12)
    ratio = np.tan(0.5 * np.abs(angles[~zigzag])) / np.tan(0.5 * np.radians(largest))
    assert ratio == pytest.approx(np.cos(ANGLE), rel=1e-11)
    assert [fold_files.SIGNS[one.assignment] for one in own.pattern.creases] == np.sign(angles).tolist()
    assert np.abs(own.gaps(angles)[0]).max() < 1e-13


def test_miura_has_its_lengths_and_ratio_of_poisson(tmp_path: pathlib.Path) -> None:
    """Sides of a cell and Poisson's ratio in the plane (Schenk, Guest 2013), with the slope theta of the facets."""
    own, (a, b) = loops(miura(tmp_path, (4, 4))), (0.2, 0.3)

    def cell(theta: float) -> tuple[float, float]:
        """Lengths of a cell along zigzag and straight creases, whose facets have the slope theta."""
        state = own.folded(2.0 * theta)
        x = np.empty((25, 3))
        for k, facet in enumerate(own.pattern.facets):
            x[list(facet)] = state.at(k, own.pattern.x[list(facet)])
        x = x.reshape(5, 5, 3)
        return float(np.linalg.norm(x[0, 2] - x[0, 0])), float(np.linalg.norm(x[2, 0] - x[0, 0]))

    theta, d = np.radians(50.0), 1e-4
    stretch = np.cos(theta) * np.tan(ANGLE)
    across = 2.0 * b * stretch / np.hypot(1.0, stretch)
    assert cell(theta) == pytest.approx(
        (across, 2.0 * a * np.sqrt(1.0 - (np.sin(theta) * np.sin(ANGLE)) ** 2)), rel=1e-11
    )
    strains = np.log(np.divide(cell(theta + d), cell(theta - d)))
    assert -strains[1] / strains[0] == pytest.approx(-(stretch**2), rel=1e-6)


def test_frames_are_folded_states(tmp_path: pathlib.Path) -> None:
    """A frame with six digits gives the state that closes; one that is off is refused with its gap."""
    path = miura(tmp_path)
    own = loops(path)
    state = own.folded(np.radians(80.0))
    x = np.empty((len(own.pattern.x), 3))
    for k, facet in enumerate(own.pattern.facets):
        x[list(facet)] = state.at(k, own.pattern.x[list(facet)])
    turned = np.round(x @ np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]).T + [1.0, 2.0, 3.0], 6)
    wrong = turned.copy()
    wrong[7, 0] += 0.05
    frames = [{"frame_title": name, "vertices_coords": own_x.tolist(), "frame_parent": 0, "frame_inherit": True}
              for name, own_x in (("stowed", turned), ("torn", wrong))]  # fmt: skip
    again = loops(changed(path, file_frames=frames))
    found = again.of_frame("stowed", 1e-3)
    assert found.angles == pytest.approx(state.angles, abs=1e-4)
    assert np.abs(again.gaps(found.angles)[0]).max() < 1e-13
    assert found.at(5, again.pattern.x[list(again.pattern.facets[5])]) == pytest.approx(
        turned[list(again.pattern.facets[5])], abs=1e-5
    )
    with pytest.raises(InputError, match=r"frame 'torn' of .* is no state of its rigid facets: vertex \d+ is 0.0"):
        again.of_frame("torn", 1e-3)
    with pytest.raises(InputError, match=r"has no frame 'flat' .*; frames: 'stowed', 'torn'"):
        again.of_frame("flat", 1e-3)


def test_derivatives_of_gaps() -> None:
    """Against central differences, at angles at which no loop is closed."""
    own = Loops("miura-8x8", fold_files.read("miura-8x8", ""))
    rng = np.random.default_rng(1)
    angles, along = rng.normal(size=(2, len(own.pattern.creases)))
    slope = (own.gaps(angles + 1e-6 * along)[0] - own.gaps(angles - 1e-6 * along)[0]) / 2e-6
    assert own.gaps(angles)[1] @ along == pytest.approx(slope, abs=1e-8)


@pytest.mark.parametrize(
    ("keys", "why"),
    [
        ({"edges_vertices": None}, "needs edges_vertices; has none"),
        ({"vertices_coords": [[0, 0], [1, "x"]]}, r"vertices_coords\[1\] of the key frame .* two or three numbers"),
        ({"edges_assignment": ["Q"] * 31}, r"edges_assignment\[0\] .* is 'Q'; it must be one of M, V, U, F, J, B, C"),
        ({"edges_foldAngle": [200.0] * 31}, r"edges_foldAngle\[0\] .* is 200.0; it must be degrees from -180 to 180"),
        ({"edges_foldAngle": [9.0] * 31}, r"edges_foldAngle\[\d+\] .* its edges_assignment is 'M'"),
        ({"edges_assignment": ["B"] * 31}, r"is assigned B, boundary, but facets \d+ and \d+ meet there"),
        ({"edges_assignment": ["C"] * 31}, "facet 1 of 'sheet.fold' is not connected with facet 0"),
        ({"faces_vertices": [[0, 1, 40]]}, r"faces_vertices\[0\] .* from 0 to 19"),
        ({"faces_vertices": [[0, 4, 5, 1], [0, 4, 5]]}, "which is no edge|lie on one another"),
        ({"frame_unit": "parsec"}, "frame_unit of .* is 'parsec'"),
        ({"vertices_coords": [[0, 0, 0.1 * k] for k in range(20)]}, "is not flat, its z coordinates differ by 1.9"),
    ],
)
def test_bad_files_are_refused(tmp_path: pathlib.Path, keys: dict[str, Any], why: str) -> None:
    """Each with one sentence that names the key."""
    path = changed(miura(tmp_path), **keys)
    with pytest.raises(InputError, match=why):
        loops(path)


def test_patterns_that_do_not_fold_are_refused(tmp_path: pathlib.Path) -> None:
    """All creases of a vertex as valleys; three facets at an edge."""
    path = miura(tmp_path)
    words = json.loads(path.read_text("utf-8"))["edges_assignment"]
    all_valleys = ["V" if word in "MV" else word for word in words]
    with pytest.raises(InputError, match=r"do not fold to .* deg: a gap of|is assigned V, but the facets fold it by"):
        loops(changed(path, edges_assignment=all_valleys)).folded(0.5)
    cube = {"vertices_coords": [[0, 0], [1, 0], [0, 1], [1, 1], [2, 1]], "edges_assignment": None,
            "edges_vertices": [[0, 1], [0, 2], [1, 2], [1, 3], [2, 3], [1, 4], [2, 4]],
            "faces_vertices": [[0, 1, 2], [1, 3, 2], [1, 4, 2]]}  # fmt: skip
    with pytest.raises(InputError, match="has 3 facets, 0, 1, 2, at the edge between vertices"):
        loops(changed(path, **cube))
