"""The guard against loss of speed decides rightly on synthetic times; nothing is timed here."""

import importlib.util
import json
import pathlib
import random

import pytest

ROOT = pathlib.Path(__file__).parents[2]


@pytest.fixture(scope="module")
def guard():
    """The module benchmarks/guard.py."""
    spec = importlib.util.spec_from_file_location("guard", ROOT / "benchmarks" / "guard.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_ratios_are_of_the_least_times(guard):
    found = guard.ratios({"loop": [2.0, 1.0, 9.0], "a": [5.0, 3.0], "b": [0.5]})
    assert found == {"a": 3.0, "b": 0.5}


def test_a_loss_of_20_per_cent_fails(guard):
    stored = {"a": 1.0, "b": 2.0}
    assert guard.too_slow({"a": 1.19, "b": 2.39}, stored) == []
    assert guard.too_slow({"a": 1.2, "b": 2.39}, stored) == ["a"]
    assert guard.too_slow({"a": 0.5, "new": 100.0}, stored) == []


def test_only_slow_works_are_measured_again_and_the_least_counts(guard):
    asked = []
    values = {"a": iter([1.5, 1.3, 1.1]), "b": iter([2.0])}

    def measure(names):
        asked.append(list(names))
        return {name: next(values[name]) for name in names}

    found, slow = guard.check(measure, ["a", "b"], {"a": 1.0, "b": 2.0})
    assert asked == [["a", "b"], ["a"], ["a"]]
    assert (found, slow) == ({"a": 1.1, "b": 2.0}, [])


def test_a_true_loss_fails_after_all_rounds(guard):
    asked = []

    def measure(names):
        asked.append(list(names))
        return dict.fromkeys(names, 1.25)

    assert guard.check(measure, ["a"], {"a": 1.0})[1] == ["a"]
    assert len(asked) == guard.ROUNDS


@pytest.mark.parametrize("slower", [1.0, 1.25])
def test_noise_neither_hides_nor_feigns_a_loss(guard, slower):
    """Times with 4 % of noise and, in 30 % of the runs, up to three times the time."""
    source = random.Random(7)

    def sample(true):
        value = true * (1.0 + abs(source.gauss(0.0, 0.04)))
        return value * (source.uniform(1.0, 3.0) if source.random() < 0.3 else 1.0)

    def measure(names):
        times = {name: [sample(slower) for _ in range(11)] for name in names}
        return guard.ratios({"loop": [sample(1.0) for _ in range(11)], **times})

    failed = sum(bool(guard.check(measure, ["a"], {"a": 1.0})[1]) for _ in range(500))
    assert failed == 0 if slower == 1.0 else failed >= 495


def test_what_was_stored_last_for_this_kind_of_machine_counts(guard, tmp_path):
    path = tmp_path / "history.jsonl"
    assert guard.read(path) == []
    lines = [
        {"machine": "x", "stored": True, "ratios": {"a": 1.0}},
        {"machine": "x", "stored": True, "ratios": {"a": 2.0}},
        {"machine": "x", "stored": False, "ratios": {"a": 3.0}},
        {"machine": "y", "stored": True, "ratios": {"a": 4.0}},
    ]
    path.write_text("".join(json.dumps(line) + "\n" for line in lines))
    history = guard.read(path)
    assert guard.stored_ratios(history, "x") == {"a": 2.0}
    assert guard.stored_ratios(history, "z") == {}


def test_the_history_of_the_repository_can_be_read(guard):
    history = guard.read(guard.HISTORY)
    assert history
    assert history[0]["stored"]
    for line in history:
        assert {"date", "version", "machine", "python", "stored", "passed", "ratios"} == set(line)
        assert all(value > 0.0 for value in line["ratios"].values())
