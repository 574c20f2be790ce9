"""Which of the modes found in the signals are the body's."""

from __future__ import annotations

import itertools

import numpy as np

from evolvent_massprops.description import OnSprings
from evolvent_massprops.inertia import mac
from evolvent_massprops.inertia.vibration import NormalModes
from evolvent_massprops.modal import Modal

#: Velocity beside that of the strongest mode below which a mode may be no mode of the body: products of the others.
FAINT = 1e-3
#: Velocity beside that of the weaker parent below which a mode at their sum, difference or double is their product.
PRODUCT = 0.1
#: Agreement of a shape with one mode below which, and with several below whose, it is several modes seen as one.
SINGLE = 0.98


def select(given: OnSprings, modal: Modal) -> tuple[tuple[int, ...], list[str], list[str]]:
    """Modes that are used: as many as the body has, the strongest."""
    most, m = most_modes(given), modal.modes.order
    warnings = list(modal.warnings)
    shapes = modal.modes.mode_shapes()
    strength = np.sum((modal.modes.amplitude * modal.frequency[:, None]) ** 2, axis=1)
    faint = [k for k in range(m) if strength[k] < FAINT**2 * np.max(strength)]
    products = _products(modal, strength)
    left = [int(k) for k in np.argsort(-strength) if k not in faint and k not in products and k not in modal.hum]
    used = tuple(sorted(left[:most]))
    why = [f"All {m} modes found in the signals are used."] if len(used) == m else []
    if texts := [f"{modal.frequency[k]:.6g} rad/s is {text}" for k, text in products.items() if k not in faint]:
        why.append(
            f"Left out as harmonics or combinations of stronger modes in a motion that is not quite linear: "
            f"{', '.join(texts)}."
        )
    if modal.hum:
        listed = ", ".join(f"{modal.frequency[k]:.6g} rad/s" for k in modal.hum)
        why.append(f"Left out as mains hum, which does not decay: {listed}.")
    if faint:
        why.append(
            f"Fainter than {FAINT:g} of the strongest, by velocity, and left out: "
            + ", ".join(f"{modal.frequency[k]:.6g} rad/s" for k in faint)
            + ". So small a mode may be a harmonic or combination of the others in a motion that is not quite linear."
        )
    m = len(left)
    if m > most:
        out = [k for k in range(modal.modes.order) if k not in used and k in left]
        why.append(
            f"Of {m} modes found the {most} strongest by velocity are used, for the body on this stand has {most}; "
            "left out: " + ", ".join(f"{modal.frequency[k]:.6g} rad/s" for k in out) + "."
        )
        weakest = min(strength[list(used)])
        close = [k for k in out if strength[k] > 0.1 * weakest]
        if close:
            warnings.append(
                f"the mode at {modal.frequency[close[0]]:.6g} rad/s was left out, but is hardly weaker than one that "
                "was used; choose with identification.band or identification.order"
            )
    for k in used:
        if shapes.realness[k] < 0.95:
            warnings.append(
                f"mode {k + 1} ({modal.frequency[k]:.6g} rad/s) does not move all sensors in phase (collinearity "
                f"{shapes.realness[k]:.2f}): two modes close together, or strong damping"
            )
    return used, why, warnings


def _products(modal: Modal, strength: np.ndarray) -> dict[int, str]:
    """Modes at doubles, sums and differences of stronger ones, within half a line of the record, and of which."""
    w, found = modal.frequency, {}
    near = np.pi / modal.reading.time[-1]
    order = [int(k) for k in np.argsort(-strength)]
    for place, k in enumerate(order):
        parents = [j for j in order[:place] if j not in found]
        for i, j in itertools.combinations_with_replacement(parents, 2):
            if strength[k] > PRODUCT**2 * min(strength[i], strength[j]):
                continue
            ways = [(w[i] + w[j], f"{w[i]:.6g} + {w[j]:.6g}" if i != j else f"twice {w[i]:.6g}")]
            if i != j:
                ways.append((abs(w[i] - w[j]), f"{max(w[i], w[j]):.6g} - {min(w[i], w[j]):.6g}"))
            texts = [
                text for at, text in ways if abs(at - w[k]) < max(near, 5.0 * np.nan_to_num(modal.frequency_std[k]))
            ]
            if texts:
                found[k] = texts[0]
                break
    return found


def separate(
    model: NormalModes, modal: Modal, used: tuple[int, ...], sensors: np.ndarray, directions: np.ndarray
) -> tuple[tuple[int, ...], list[str]]:
    """Used modes without those in which several of the body's are seen as one, and what to say of these.

    Notes
    -----
    Modes nearer to each other than 2 pi / T share a line of a record of the length T. Where the measured shape is none
    of theirs, but a sum of them, it says nothing of either.
    """
    T = float(modal.reading.time[-1])
    line = 2.0 * np.pi / T
    w, v = np.sqrt(model.eigenvalue), model.at(sensors, directions)
    kept, texts = [], []
    for k in used:
        near = np.flatnonzero(np.abs(w - modal.frequency[k]) < line)
        shape = modal.shapes[k]
        if near.size > 1 and np.max(mac(shape[None], v[near])) < SINGLE:
            U = np.linalg.svd(v[near].T, full_matrices=False)[0]
            if np.sum((U.T @ shape) ** 2) > SINGLE * np.sum(shape**2):
                gap = float(np.ptp(w[near]))
                longer = f"; record for {2.0 * np.pi / gap:.3g} s to see them" if gap > 1e-6 * w[near[0]] else ""
                texts.append(
                    f"the body's modes at {' and '.join(f'{x:.5g}' for x in w[near])} rad/s cannot be distinguished in "
                    f"{T:.3g} s and appear as one at {modal.frequency[k]:.6g} rad/s, which is left out{longer}"
                )
                continue
        kept.append(k)
    return tuple(kept), texts


def missing_modes_warning(
    given: OnSprings, modal: Modal, used: tuple[int, ...], sensors: np.ndarray, directions: np.ndarray
) -> str:
    """A warning if fewer modes are identified than the sensors could show; else none."""
    motions = np.concatenate([directions, np.cross(sensors, directions)], axis=1)
    most = min(int(np.linalg.matrix_rank(motions, tol=1e-6 * float(np.abs(motions).max()))), most_modes(given))
    if len(used) >= most or given.identification.band is not None:
        return ""
    texts = ", ".join(f"{modal.frequency[k]:.6g}" for k in used)
    return (
        f"only {len(used)} of the {most} modes that these sensors can show were found (at {texts} rad/s); release at a "
        "point that sets all of them going, or record for longer"
    )


def most_modes(given: OnSprings) -> int:
    """Modes that the body has."""
    return 3 if given.stand.support == "guided" or given.identification.model == "vertical" else 6
