"""A case with a margin whose value is known in closed form."""

import math

NONE = ["friction", "hysteresis", "harness", "motor losses", "adhesion", "load", "acceleration"]
FRICTION = 0.01


def zero(*given):
    """The key `zero` of a case that gives some of the resistances."""
    return [one for one in NONE if one not in given]


def case(**margin):
    """An arm that a spring turns from 0 to a latch at 90 degrees, against friction."""
    return {
        "system": "structure",
        "parts": {
            "arm": {"kind": "rigid-body", "mass": 2.0, "inertia": [0.1, 0.1, 0.2], "position": [0.5, 0, 0]},
            "pivot": {"kind": "joint", "type": "revolute", "a": [0, 0, 0], "b": ["arm", [-0.5, 0, 0]]},
            "hinge": {
                "kind": "joint-spring", "joint": "pivot", "stiffness": 0.1, "rest": math.pi, "damping": 0.02,
                "latch": math.pi / 2, "latch_stiffness": 500.0, "friction": FRICTION,
            },
        },
        "simulate": {"until": "4 s", "every": "0.1 s"},
        "margin": {"zero": zero("friction"), "stations": 5} | margin,
    }  # fmt: skip
