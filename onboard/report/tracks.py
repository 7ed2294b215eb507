"""What a diagnosis and a replay have over time, as tracks for viewers of logs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from onboard.answers.replay import Replay
from onboard.core.diagnosis.records import Diagnosis
from onboard.core.estimate.result import SIX_NAMES
from onboard.report.mcap import Track

if TYPE_CHECKING:
    from onboard.report.replay_charts import Drawn

COMPONENTS = ("north", "east", "down")


def of_diagnosis(diagnosis: Diagnosis) -> list[Track]:
    """Velocity residual before and after, m/s, and what each effect makes of it.

    Times are s since the first inertial sample.
    """
    place, s = f"/onboard/imu{diagnosis.imu}", diagnosis.series
    columns = {
        f"{name}_{when}": values[:, k]
        for when, values in (("before", s.before), ("after", s.after))
        for k, name in enumerate(COMPONENTS)
    }
    tracks = [Track(f"{place}/velocity_residual", s.t, columns)]
    for effect in diagnosis.effects:
        if (i := effect.imprint) is not None:
            data = {"data": i.left, "effect": i.made}
            tracks.append(Track(f"{place}/effect/{effect.name}/{i.axis}", i.t, data))
    return tracks


def of_replay(result: Replay, chronicle: Drawn) -> list[Track]:
    """How the six numbers of each accelerometer converged, and its velocity error, m/s."""
    tracks = [Track("/onboard/speed", chronicle.speed.t, {"speed": chronicle.speed.y})]
    for answer in result.answers:
        place, f = f"/onboard/imu{answer.imu}", chronicle.figures(answer.imu)
        c = f.course
        columns = {
            f"{name.replace(' ', '_')}{kind}": values[:, k]
            for k, name in enumerate(SIX_NAMES)
            for kind, values in (("", c.value), ("_sigma", c.sigma), ("_in_force", c.in_force))
        }
        tracks += [
            Track(f"{place}/estimate", c.t, columns),
            Track(f"{place}/velocity_error/before", f.before.t, {"error": f.before.y}),
            Track(f"{place}/velocity_error/after", f.after.t, {"error": f.after.y}),
        ]
    return tracks
