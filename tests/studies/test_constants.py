"""Constants of expressions and entries of tables as keys of studies, designs and derivatives."""

import pytest

import evolvent as ev
from evolvent import InputError, System, parts

KEPT = "bob.velocity.x.last"


def pushed() -> System:
    """A free mass under a*t and a table: v = (a/2 + 1/2 * row) / m at 1 s."""
    s = System()
    s.add(parts.Point(mass=2.0), "bob")
    given = {"expression": "a*t", "constants": {"a": 3.0}}
    s.add(parts.Load(at="bob", direction=(1, 0, 0), profile=given), "push")
    s.add(parts.Load(at="bob", direction=(1, 0, 0), profile=[[0, 0], [1, 4]]), "side")
    return s


KEYS = ["parts.push.profile.constants.a", "parts.side.profile.table.1.1"]


@pytest.mark.parametrize("key", KEYS)
def test_derivatives(key: str) -> None:
    found = pushed().sensitivity(KEPT, [key], until=1.0, method="energy-momentum", step=0.05)
    assert found.dataset.derivative.values[0, 0] == pytest.approx(0.25, rel=1e-6)


def test_dispersions_and_designs() -> None:
    study = {"case": pushed(), "sample": "corners", "over": {KEYS[0]: "uniform(2, 4)"}, "keep": [KEPT]}
    found = ev.disperse(study, until="1 s")[KEPT]
    assert sorted(found.values) == pytest.approx([1.5, 2.0], rel=1e-6)
    design = ev.optimize(
        pushed(), vary={KEYS[0]: "1 to 9"}, maximize=KEPT, subject_to=[f"{KEPT} <= 2.5 m/s"], until="1 s"
    )
    assert design.values[KEYS[0]] == pytest.approx(6.0, rel=1e-4)


def test_what_is_refused() -> None:
    over = {"parts.push.profile.constants.b": "5%"}
    with pytest.raises(InputError, match=r"the case gives nothing at 'parts.push.profile.constants.b'"):
        ev.disperse({"case": pushed(), "sample": "corners", "over": over, "keep": [KEPT]}, until=1.0)
    with pytest.raises(InputError, match="simulate is missing"):
        ev.optimize(pushed(), vary={KEYS[0]: "1 to 9"}, maximize=KEPT)
