"""Results of a part's own, beside those of its family."""

from __future__ import annotations

import pathlib
from typing import Any, Literal

import numpy as np
import pytest

import evolvent as ev
from evolvent import parts
from evolvent.results.observe import Observed
from observe.seeing import close, run


class Tendon(parts.Spring):
    """A spring that shows its strain."""

    kind: Literal["tendon"] = "tendon"

    def observe(self, view: Any, name: str, found: Observed) -> None:
        strain = found.variables["extension"].values / self.length
        found.scalar("strain", strain, "1", "extension over the natural length")
        found.plots = ["strain"]


def test_a_part_adds_results_of_its_own(tmp_path: pathlib.Path) -> None:
    system = ev.System()
    system.add(parts.Point(mass=2.0, position=(1.2, 0.0, 0.0)), "bob")
    system.add(Tendon(a=(0.0, 0.0, 0.0), b="bob", length=1.0, stiffness=50.0), "cord")
    found = run(system, np.linspace(0.0, 1.0, 11))
    strain = 0.2 * np.cos(5.0 * found.t)
    close(found.of("cord", "strain"), strain, part=1e-4)
    close(found.of("cord", "force"), 50.0 * strain, part=1e-4)
    assert found.tree["cord"].attrs["kind"] == "tendon"
    assert found.tree.ev.table()[1].label == "cord.strain"
    ev.save(found.tree, tmp_path / "run.nc")
    assert ev.open(tmp_path / "run.nc")["cord"].strain.attrs["units"] == "1"


def test_what_is_no_part_is_refused() -> None:
    class Thing:
        def write(self, builder: Any, name: str) -> None:
            raise AssertionError

    for thing in (Thing(), parts.Point, 3):
        with pytest.raises(ev.InputError, match="is not a part"):
            ev.System().add(thing)  # type: ignore[arg-type]
