"""The configuration's sections turned into the settings of the parts that they are about."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from onboard.core.estimate.settings import CalibratorSettings
from onboard.core.gps.limits import TrustLimits
from onboard.daemon.setup import configuration, secret_files
from onboard.daemon.setup.recording import RollingRecorder
from onboard.errors import ConfigurationError
from onboard.mavlink.endpoint import Endpoint
from onboard.mavlink.recorder import Recorder
from onboard.mavlink.signing import Signing, SigningRecord
from onboard.mavlink.streams import StreamRequest
from onboard.push.policy import Mode, PolicySettings


def policy_settings(push: configuration.PushSettings) -> PolicySettings:
    """[push]."""
    return PolicySettings(
        mode=Mode(push.policy),
        disarmed_s=push.disarmed_s,
        scale_min=push.scale_min,
        scale_max=push.scale_max,
        offset_max=push.offset_max,
        sure=push.sure,
        least_change=push.least_change,
        in_flight_scale_step=push.in_flight_scale_step,
        in_flight_offset_step=push.in_flight_offset_step,
    )


def estimator_settings(estimator: configuration.EstimatorSettings) -> CalibratorSettings:
    """[estimator]."""
    trust = replace(
        TrustLimits(),
        satellites=estimator.satellites_min,
        hdop=estimator.hdop_max,
        speed_accuracy=estimator.speed_accuracy_max,
        duration=estimator.window_s or None,
    )
    return replace(
        CalibratorSettings(),
        minimum_s=estimator.minimum_trusted_s,
        buffer_s=estimator.buffer_s,
        memory_s=estimator.memory_s,
        trust=trust,
    )


def stream_requests(rates: configuration.RatesSettings) -> tuple[StreamRequest, ...]:
    """[link.rates]; rate 0 asks for nothing."""
    wanted = (
        (rates.imu, ("RAW_IMU", "HIGHRES_IMU", "SCALED_IMU2", "SCALED_IMU3")),
        (rates.attitude, ("ATTITUDE",)),
        (rates.gps, ("GPS_RAW_INT", "GPS2_RAW")),
        (rates.status, ("EKF_STATUS_REPORT", "EXTENDED_SYS_STATE", "VIBRATION")),
        (rates.regime, ("VFR_HUD",)),
        (min(rates.regime, 1.0), ("WIND", "BATTERY_STATUS", "SYSTEM_TIME")),
    )
    return tuple(StreamRequest(name, rate) for rate, names in wanted if rate for name in names)


def endpoints(link: configuration.LinkSettings) -> tuple[Endpoint, ...]:
    """[link] endpoints.

    Raises:
        ConfigurationError: one of them is not understood.
    """
    parsed = tuple(Endpoint.parse(text) for text in link.endpoints)
    for endpoint in parsed:
        if not configuration.is_host(endpoint.host):
            raise ConfigurationError(f"endpoint {endpoint}: {endpoint.host!r} is no host's name")
    return parsed


def signing(
    link: configuration.LinkSettings,
    wall_clock: Callable[[], float],
    record: SigningRecord | None = None,
) -> Signing | None:
    """[link] signing_key_file: the passphrase as entered in a ground station.

    Args:
        link: the section.
        wall_clock: Unix time, s.
        record: time stamps of an earlier run.

    Raises:
        ConfigurationError: the file cannot be read.
    """
    if link.signing_key_file is None:
        return None
    secret = secret_files.read_secret(link.signing_key_file, key="[link] signing_key_file")
    return Signing.from_passphrase(secret, wall_clock, record)


def http_token(http: configuration.HttpSettings) -> str | None:
    """[http] token or token_file; None if neither is given.

    Raises:
        ConfigurationError: the file cannot be used.
    """
    if http.token_file is None:
        return http.token
    return secret_files.read_secret(http.token_file, key="[http] token_file")


def recorder(
    recording: configuration.RecordingSettings, state: Path, wall_clock: Callable[[], float]
) -> Recorder | None:
    """[recording]; beside the state unless it says where."""
    if not recording.enabled:
        return None
    given = recording.directory
    return RollingRecorder(
        Path(given).expanduser() if given else state / "recordings",
        keep=recording.keep_files,
        file_bytes=int(recording.file_size_mb * 1e6),
        wall_clock=wall_clock,
    )
