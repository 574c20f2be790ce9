"""Numbers as a certificate writes them."""

from __future__ import annotations

import math


def shown(value: float, std: float = 0.0) -> str:
    """`value ± std`, both to the digit where the deviation has its second; six digits of a value without one."""
    if not math.isfinite(value):
        return "-"
    if not (std > 0.0 and math.isfinite(std)):
        return f"{value:.6g}"
    return f"{rounded(value, std)} ± {rounded(std, std)}"


def rounded(value: float, std: float) -> str:
    """`value` to the digit where `std` has its second."""
    if not (math.isfinite(value) and std > 0.0 and math.isfinite(std)):
        return f"{value:.6g}"
    std = float(f"{std:.1e}")
    place = 1 - math.floor(math.log10(std))
    if place < 0:
        value = round(value, place)
        place = 0
    size = max(abs(value), std)
    if place > 9 or size >= 1e12:
        return f"{value:.{max(1, 1 + math.floor(math.log10(size)) - math.floor(math.log10(std)))}e}"
    return f"{value:.{place}f}"
