"""What to show of a run: numbers and figures."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.view import show, table
from evolvent_base.figures import Figure, Line, Number, Panel, numbers_of

RPM = 60.0 / (2.0 * np.pi)


def numbers(run: Any) -> list[Number]:
    """Spin rates at the start and end, and the difference from straight wires."""
    rate, straight, lengths = run.spin_rate.values, run.spin_rate_straight.values, run.boom_length.values
    gap = np.abs(rate - straight)
    k = int(np.argmax(gap))
    rows: list[tuple[Any, ...]] = [
        ("spin rate at the start", f"{rate[0] * RPM:.5g} rpm", (rate[0] * RPM, "rpm")),
        ("spin rate at the end", f"{rate[-1] * RPM:.5g} rpm", (rate[-1] * RPM, "rpm")),
        (
            "boom lengths at the end",
            " / ".join(f"{length:.6g}" for length in lengths[-1]) + " m",
            *((length, "m", f"booms of pair {n}") for n, length in enumerate(lengths[-1], 1)),
        ),
        (
            "largest difference from straight wires",
            f"{gap[k] * RPM:.2g} rpm at {run.time.values[k]:.6g} s",
            (gap[k] * RPM, "rpm"),
            (run.time.values[k], "s", "time"),
        ),
    ]
    return numbers_of(rows) + table.numbers(run)


def figures(run: Any) -> list[Figure]:
    """Spin rate beside that with straight wires, and lengths of the booms, over time."""
    time = run.time.values / 3600.0
    rates = [
        Line(x=time, y=run.spin_rate.values * RPM, label="run", color=0),
        Line(x=time, y=run.spin_rate_straight.values * RPM, label="straight wires", color=1, style="--"),
    ]
    lengths = [
        Line(x=time, y=run.boom_length.values[:, p], label=f"pair {pair}", color=p)
        for p, pair in enumerate(("1-2", "3-4"))
    ]
    panels = [
        Panel(x_label="time without the hours between steps, h", y_label="spin rate, rpm", lines=rates, y_zero=True),
        Panel(x_label="time without the hours between steps, h", y_label="boom length, m", lines=lengths),
    ]
    own = Figure(name="spin-rate", title="Spin rate as wire booms pay out", panels=panels)
    return [own, *show.figures(run)]
