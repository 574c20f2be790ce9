"""A name without its number stands for all parts that have it, as one of a repeated part in a case file does."""

import pytest

import evolvent
from evolvent import InputError, System

CASE = {
    "system": "structure",
    "parts": {
        "panel": {"repeat": {"count": 3, "step": [1, 0, 0]}, "kind": "rigid-body", "mass": 1.0, "inertia": [1, 1, 1]},
        "cord": {
            "repeat": {"count": 2}, "kind": "spring", "a": "panel {n}", "b": "panel {n+1}", "stiffness": 9.0,
            "length": 0.9,
        },
    },
}  # fmt: skip


def system() -> System:
    return evolvent.load(CASE)


@pytest.mark.parametrize("key", ["cord.stiffness", "parts.cord.stiffness"])
def test_all_of_them_are_set(key: str) -> None:
    found = system().with_values({key: "0.2 N/m"})
    assert [found.parts[f"cord {n}"].stiffness for n in (1, 2)] == [0.2, 0.2]
    assert system().with_values({"cord 2.stiffness": 3.0, "panel.mass": 2.0}).parts["cord 1"].stiffness == 9.0


@pytest.mark.parametrize(
    ("key", "value"),
    [("panel.position", (0, 0, 0)), ("panel.position.0", 1.0), ("panel.inertia.0", 1.0), ("cord.a", "panel 1")],
)
def test_what_differs_or_turns_with_them_is_refused(key: str, value: object) -> None:
    name, _, rest = key.partition(".")
    with pytest.raises(InputError, match=f"'{key}' is not one number that is the same in all .* '{name} 1.{rest}'"):
        system().with_values({key: value})


def test_other_keys_are_refused_as_those_of_one_part() -> None:
    with pytest.raises(InputError, match="stiffness"):
        system().with_values({"cord.stifness": 1.0})
    with pytest.raises(InputError, match="no part is called 'cords'"):
        system().with_values({"cords.stiffness": 1.0})


def test_the_derivative_by_all_is_the_sum_of_those_by_each() -> None:
    found = (
        system()
        .sensitivity(
            "panel 1.position.x.last",
            ["cord.stiffness", "cord 1.stiffness", "cord 2.stiffness"],
            until=0.5,
            check=False,
            method="energy-momentum",
            step=0.01,
        )
        .dataset.derivative.values[0]
    )
    assert found[0] == pytest.approx(found[1] + found[2], rel=1e-5)
    assert abs(found[1]) > 0.0
