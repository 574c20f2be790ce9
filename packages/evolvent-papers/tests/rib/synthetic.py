"""Runs that no solver has made: trees with a run's variables, filled from the closed forms of `reference`."""

from __future__ import annotations

import datetime
import json
from types import SimpleNamespace

import numpy as np
import xarray as xr

from evolvent import cases, closed_forms
from evolvent.families.contact.observer_surfaces import mean_rate
from evolvent.results import attributes, variable
from evolvent.results.tree import CAUSES

WIND = {"phase": "wind", "drive": {"kind": "torque", "torque": 0.2}}
HOLD = {"phase": "hold", "drive": {"kind": "torque", "torque": 0.2}, "hold": {"time": 60}}
END = datetime.datetime(2020, 1, 1, tzinfo=datetime.UTC)
DEPLOY = {"phase": "deploy", "damping": {"alpha": 0}}


def synthetic(content, overrides=None) -> xr.DataTree:
    """A run of the phase that `content` has, as the closed forms have it; all ribs alike."""
    case = cases.load({"system": "wrapped-rib", **content}, overrides)
    strip, drive = case.strip, case.drive
    torque = drive.torque if drive is not None and drive.torque is not None else 0.0
    zero = np.zeros(401)
    if case.phase == "wind":
        motion = closed_forms.string_winding(strip, torque, case.damping.alpha, samples=301)
        # after the string's end the rib rests on the hub
        rest = motion.time[-1] * (1.0 + np.arange(1, 101) / 200.0)
        time = np.concatenate([motion.time, rest])

        def then(values, last):
            return np.concatenate([values, np.full(100, last)])

        wrap, swing = then(motion.wrap, strip.length / strip.radius), then(motion.swing, 0.5 * np.pi)
        speed, kinetic = then(motion.tip_speed, 0.0), then(motion.kinetic, 0.0)
        work, drag = then(motion.work, motion.work[-1]), then(motion.drag, motion.drag[-1])
        struck = then(np.zeros(301), motion.kinetic[-1])
    elif case.phase == "hold":
        time = np.linspace(0.0, case.duration, 401)
        wrap, swing = zero + strip.length / strip.radius, zero + 0.5 * np.pi
        speed, kinetic, work, drag, struck = zero, zero, zero, zero, zero
    else:
        time = np.linspace(0.0, case.duration, 401)
        free = closed_forms.deployed_length(strip, time)
        wrap, swing = (strip.length - free) / strip.radius, zero + 0.5 * np.pi
        speed = np.where(time > 0.0, closed_forms.deployment_speed(strip), 0.0)
        kinetic = closed_forms.bending_energy(strip) * free / strip.length
        work, drag, struck = zero, zero, zero
    count = case.rib.count

    def shape(arc):
        flat = np.stack(
            [
                [
                    closed_forms.string_shape(strip, arc, wrap=w, swing=th, at=2.0 * np.pi * b / count)
                    for b in range(count)
                ]
                for w, th in zip(wrap, swing, strict=True)
            ]
        )
        return np.concatenate([flat, np.zeros((*flat.shape[:-1], 1))], axis=-1)

    n = case.rib.elements
    nodes, step = np.linspace(0.0, strip.length, n + 1), strip.length / n
    middle = 0.5 * (nodes[1:] + nodes[:-1])
    places, ahead, back = shape(nodes), shape(nodes + 1e-6), shape(nodes - 1e-6)
    slopes = (ahead - back) / 2e-6
    slopes[:, :, 0], slopes[:, :, -1] = (ahead - places)[:, :, 0] / 1e-6, (places - back)[:, :, -1] / 1e-6
    if case.phase != "wind":  # the string's kink at the root is not the start of a wound rib
        slopes[0, :, -1] = slopes[1, :, -1]
    on_hub = middle[None, :] <= strip.radius * wrap[:, None] + 1e-9
    tension = np.where(on_hub, closed_forms.wound_tension(strip, torque, middle), 0.0)
    pressed = tension / strip.radius * step
    arc = np.linspace(0.0, strip.length, 4 * n + 1)
    pressure = closed_forms.wound_pressure(strip, torque, arc) * (arc <= strip.radius * wrap[:, None] + 1e-9)
    force = np.trapezoid(pressure, arc, axis=1)
    impulse = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(time) * (force[1:] + force[:-1]))])
    bending = closed_forms.bending_energy(strip) * wrap * strip.radius / strip.length
    taken = np.zeros((401, len(CAUSES)))
    taken[:, 0], taken[:, 2] = drag, struck
    defect = kinetic + bending - kinetic[0] - bending[0] - work + taken.sum(axis=1)

    def of_ribs(values):
        return np.repeat(np.asarray(values)[:, None], count, axis=1)

    data = {
        "tip_radius": (("time", "rib"), np.linalg.norm(places[:, :, -1], axis=-1), "m"),
        "wrap_angle": (("time", "rib"), of_ribs(wrap), "rad"),
        "touching_angle": (("time", "rib"), of_ribs(wrap), "rad"),
        "tip_speed_peak": (("rib",), np.full(count, speed.max()), "m/s"),
        "tip_speed_peak_time": (("rib",), np.full(count, time[np.argmax(speed)]), "s"),
        "hub_torque": (("time",), zero, "N m"),
        "hub_angle": (("time",), zero, "rad"),
        "energy": (("time",), kinetic + bending, "J"),
        "energy_kinetic": (("time",), kinetic, "J"),
        "energy_elastic": (("time",), bending, "J"),
        "energy_dissipated": (("time",), taken.sum(axis=1), "J"),
        "energy_losses": (("time", "cause"), taken, "J"),
        "energy_released": (("time",), zero, "J"),
        "energy_defect": (("time",), defect, "J"),
        "energy_moved": (("time",), np.maximum.accumulate(np.abs(work)), "J"),
        "work_loads": (("time",), work, "J"),
        "work_drives": (("time",), zero, "J"),
        "work_spools": (("time",), zero, "J"),
        "angular_momentum": (("time", "axis"), np.zeros((401, 3)), "kg m2/s"),
        "momentum": (("time", "axis"), np.zeros((401, 3)), "kg m/s"),
    }
    root = _dataset(data).assign_coords(
        time=variable(("time",), time, "s", "time"),
        cause=("cause", list(CAUSES)),
        axis=("axis", ["x", "y", "z"]),
        rib=("rib", np.arange(1, count + 1)),
    )
    groups = {"hub": _hub(case)}
    of_rib = {
        "tip_speed": (("time",), speed, "m/s"),
        "energy_elastic": (("time",), bending / count, "J"),
        "energy_bending": (("time",), bending / count, "J"),
    }
    of_contact = {
        "normal_force": (("time",), force, "N"),
        "mean_force": (("time",), mean_rate(time, impulse, 0.04), "N"),
        "impulse": (("time",), impulse, "N s"),
        "points": (("time",), on_hub.sum(axis=1), "1"),
        "energy_elastic": (("time",), zero, "J"),
    }
    for b in range(count):
        groups[f"rib-{b + 1}"] = _rib(case, places[:, b], slopes[:, b], nodes, tension, of_rib)
        groups[f"contact-{b + 1}"] = _contact(f"rib-{b + 1}", pressed, middle, of_contact)
    found = xr.DataTree.from_dict({"/": root, **groups})
    solution = SimpleNamespace(status="success", message="", statistics={"steps": 401}, wall_time=0.1, compile_time=0.0)
    text = cases.to_yaml(case)
    found.attrs = attributes(system=case.system, case=text, method="closed forms", solution=solution, laws={}, date=END)
    return found


def _dataset(data, drawn=()) -> xr.Dataset:
    found = xr.Dataset({name: variable(dims, values, unit, name) for name, (dims, values, unit) in data.items()})
    found.attrs = {"drawn": json.dumps(list(drawn)), "plots": "[]", "kind": "part"}
    return found


def _hub(case) -> xr.Dataset:
    data = {
        "position": (("time", "axis"), np.zeros((401, 3)), "m"),
        "attitude": (("time", "quaternion"), np.tile([1.0, 0.0, 0.0, 0.0], (401, 1)), "1"),
    }
    half, radius = 0.5 * case.hub.height, case.hub.radius
    solid = {"profile": [[-half, radius], [half, radius]], "centre": [0.0, 0.0, 0.0], "axis": [0.0, 0.0, 1.0]}
    return _dataset(
        data, [{"frame": {"origin": "position", "attitude": "attitude", "solids": [{"revolution": solid}]}}]
    )


def _rib(case, places, slopes, nodes, tension, more) -> xr.Dataset:
    data = more | {
        "position": (("time", "node", "axis"), places, "m"),
        "slope": (("time", "node", "axis"), slopes, "1"),
        "width_direction": (("time", "node", "axis"), np.broadcast_to([0.0, 0.0, 1.0], places.shape), "1"),
        "curvature": (("time", "node"), np.zeros(places.shape[:2]), "m-1"),
        "axial_force": (("time", "section"), np.repeat(tension, 2, axis=1), "N"),
    }
    line = {"points": "position", "slope": "slope", "length": case.rib.length, "values": ["curvature", "axial_force"]}
    line |= {"kind": "line", "width": case.rib.width, "across": "width_direction"}
    quarter = 0.25 * (nodes[1] - nodes[0])
    arc = np.stack([nodes[:-1] + quarter, nodes[1:] - quarter], axis=1).ravel()
    return _dataset(data, [{"line": line}]).assign_coords(arc_node=("node", nodes), arc=("section", arc))


def _contact(rib, forces, arc, more) -> xr.Dataset:
    pushes = {"size": "point_force", "arc": "arc", "beam": "beam", "body": "hub", "centre": [0.0] * 3}
    data = more | {"point_force": (("time", "contact_point"), forces, "N")}
    found = _dataset(data, [{"pushes": pushes | {"axis": [0, 0, 1]}}])
    return found.assign_coords(arc=("contact_point", arc), beam=("contact_point", [rib] * arc.size))
