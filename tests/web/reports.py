"""What reports are made of, for tests that look at them in a browser."""

import tempfile
from pathlib import Path

import numpy as np

from onboard.answers.fleet.history import history_of
from onboard.answers.fleet.record import Flown
from onboard.answers.fleet.shared_numbers import common_of
from onboard.answers.fleet.vehicles import vehicles_of
from onboard.answers.recorded import Recorded
from onboard.answers.replay import replay
from sitl import recording
from sitl.builtin.truth import ImuTruth
from sitl.recording import FlightSpec
from tests.fleet.records_by_hand import TRUE, flown

STEP = np.array([0.0, 0.0, 0.0, 0.5, 0.0, 0.0])


def flown_fleet():
    """Two vehicles, one of which has stepped, and a log that could not be read."""
    changes = {"well": lambda _: 0.0 * STEP, "step": lambda k: STEP * (k >= 5)}
    logs = [
        flown(f"{name}/{k}.BIN", TRUE + change(k), day=5.0 * k, board=f"{v:024x}", seed=10 * v + k)
        for v, (name, change) in enumerate(changes.items(), start=1)
        for k in range(9)
    ]
    everything = [*logs, Flown(Path("bad.BIN"), "bad.BIN", None, "bad.BIN: was killed")]
    histories = [history_of(v) for v in vehicles_of(everything)]
    pages = {o.name: o.name.replace("/", "-") + ".html" for o in everything if o.record}
    return everything, histories, common_of([h.vehicle for h in histories]), pages


def replayed():
    """A short flight with two accelerometers, as the report draws it."""
    truth = ImuTruth(scale=(1.02, 0.985, 1.015), offset=(0.25, -0.2, 0.3))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "flight.tlog"
        recording.write_tlog(FlightSpec(vehicle="copter", duration=60.0, imus=(truth, truth)), path)
        recorded = Recorded(watched=True)
        return replay([path], recorded), recorded.chronicle
