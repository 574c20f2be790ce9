"""A spring that is compressed to length zero has a force without a direction: it is refused at the start."""

import pytest

from evolvent import InputError, System, parts


def bob(**spring):
    system = System()
    system.add(parts.Point(mass=1.0, position=(1.0, 0.0, 0.0)), "bob")
    system.add(parts.Spring(a=(1.0, 0.0, 0.0), b="bob", **spring), "spring")
    return system


def test_its_ends_coincide_at_the_start():
    with pytest.raises(InputError, match=r"spring\.a and spring\.b are at the same place at the start.* 10 N"):
        bob(stiffness=10.0, length=1.0).assemble()


@pytest.mark.parametrize(
    "spring", [{"stiffness": 10.0}, {"stiffness": 10.0, "length": 0.0}, {"damping": 1.0, "length": 1.0}]
)
def test_without_a_force_there_is_nothing_to_refuse(spring):
    bob(**spring).assemble()
