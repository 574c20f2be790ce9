"""A spring by a table of its line: the tension at and between rows, the motion by the energy under the line."""

import math

import numpy as np
import pytest

from evolvent import System, parts
from evolvent_base.errors import InputError

#: Extension (m) and tension (N): it pushes with 20 N, hardly less up to 0.02 m, and is free from 0.05 m on.
ROWS = [[-0.05, -20.0], [-0.03, -18.0], [0.0, 0.0], [0.01, 0.0]]


def pushed(damping: float = 0.0, **keys: object) -> System:
    system = System()
    system.add(parts.Point(mass=2.0, position=(0.15, 0.0, 0.0)), "ball")
    given = {"table": ROWS, "length": 0.2, "damping": damping} | keys
    system.add(parts.Spring(a=(0.0, 0.0, 0.0), b="ball", **given), "spring")
    return system


@pytest.mark.parametrize("method", ["energy-momentum", "dopri5"])
def test_the_speed_is_that_of_the_energy_under_the_line(method: str) -> None:
    run = pushed().simulate(until=0.3, every=0.01, method=method)
    x, force = np.array(ROWS).T
    stored = float(np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(x)))
    assert run["ball"].velocity.values[-1, 0] == pytest.approx(math.sqrt(-2.0 * stored / 2.0), rel=1e-5)
    extension = run["spring"].extension.values
    assert run["spring"].force.values == pytest.approx(np.interp(extension, x, force), abs=1e-9)
    assert run["spring"].force.values[-1] == 0.0


def test_units_and_files(tmp_path) -> None:
    path = tmp_path / "line.csv"
    path.write_text("extension (mm),tension (N)\n" + "\n".join(f"{1e3 * x},{f}" for x, f in ROWS), encoding="utf-8")
    mixed = [["-50 mm", "-20 N"], ["-30 mm", "-18 N"], ["0 mm", "0 N"], ["10 mm", "0 N"]]
    expected = pushed().assemble().model.parameters
    for table in (mixed, str(path)):
        assert pushed(table=table).assemble().model.parameters == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"stiffness": 5.0}, "spring.table and spring.stiffness are both given; leave one of them out"),
        ({"law": "-x"}, "spring.table and spring.law are both given"),
        ({"table": [[0.0, 1.0], [0.0, 2.0]]}, "spring.table: row 2 is at 0 m, not above the row before, at 0 m"),
    ],
)
def test_refusals(keys: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        pushed(**keys).assemble()
