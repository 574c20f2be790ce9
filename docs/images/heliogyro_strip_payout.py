"""Figure of the theory page "Rods that pay out": run it to write heliogyro-strip-payout.png here."""

import pathlib

import numpy as np

import evolvent
from evolvent_base import plots
from evolvent_base.figures import Figure, Line, Panel


def main() -> None:
    """Draw the figure."""
    run = evolvent.run("heliogyro-strip-payout")
    t, blade = np.asarray(run["time"]), run["blade 1"]
    W = np.asarray(run["body"]["rate"])[:, 2]
    x = np.asarray(blade["position"])
    root, out = x[:, 0] - np.asarray(run["body"]["position"]), x[:, -1] - x[:, 0]
    across = root[:, 0] * out[:, 1] - root[:, 1] * out[:, 0]
    lag = -np.degrees(np.arctan2(across, root[:, 0] * out[:, 0] + root[:, 1] * out[:, 1]))
    pitch = np.degrees(np.asarray(run["pitch 1"]["angle"]))
    panels = [
        Panel(x_label="time, s", y_label="length out, m", lines=[Line(x=t, y=np.asarray(blade["deployed_length"]))]),
        Panel(x_label="time, s", y_label="spin, rad/s", lines=[Line(x=t, y=W)]),
        Panel(x_label="time, s", y_label="lag of the tip, deg", lines=[Line(x=t, y=lag)]),
        Panel(x_label="time, s", y_label="pitch, deg", lines=[
            Line(x=t, y=pitch, label="root", color=0),
            Line(x=t, y=pitch + np.degrees(np.asarray(blade["twist_angle"])[:, -1]), label="tip", color=1)]),
    ]  # fmt: skip
    figure = Figure(name="heliogyro-strip-payout", title="Strip blades that are paid out", panels=panels, height=150.0)
    plots.save(figure, pathlib.Path(__file__).with_name("heliogyro-strip-payout.png"))


if __name__ == "__main__":
    main()
