"""Captions of the figures of Yi, Yuan, Dong & Li (2017), as printed there in English."""

from __future__ import annotations

CAPTIONS = {
    1: "Wrapped-rib antenna on orbit in folded status",
    2: "Wrapping process of wrapped-rib antenna",
    3: "Spatial ANCF beam element",
    4: "Detection of contact between wrapped-rib and central hub",
    5: "Initial state of wrapping-rib and central hub",
    6: "Time course of wrapped-rib's wrapping process",
    7: "Velocity amplitude of wrapped-rib's endpoint versus time in different damping coefficients",
    8: "Number of detection points with contact versus time",
    9: "Contact force amplitude on surface of central hub",
    10: "Velocity amplitude comparison of wrapping-rib's endpoint between two methods",
}


def title(number: int, ours: str = "") -> str:
    """Title of a figure of ours: the caption as printed, the number, and what of the picture is ours."""
    return f"{CAPTIONS[number]}\n(figure {number} of Yi et al. 2017{f'; ours: {ours}' if ours else ''})"
