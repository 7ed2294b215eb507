from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from onboard.core.inputs.samples import (
    AirData,
    AttitudeSample,
    Battery,
    EkfHealth,
    GpsFix,
    ImuSample,
    ImuSource,
    ParameterValue,
    Throttle,
    Vibration,
)
from onboard.core.maths.frames import rotation_from_euler, rotation_from_quaternion
from onboard.mavlink.codec import Codec
from onboard.mavlink.decode import Decoder
from onboard.mavlink.dialect import MESSAGE_IDS, mavlink
from tests.mavlink.mavlink_peer import attitude, heartbeat, raw_imu, received

MILLI_G = 9.80665e-3


@pytest.fixture
def decoder():
    decoder = Decoder()
    decoder.decode(received(heartbeat()))
    decoder.decode(received(attitude(10_000)))
    return decoder


def decode(decoder, message):
    return decoder.decode(received(message))


def gps(
    *, time_usec=9_880_000, fix=3, vel=2000, cog=9000, eph=120, sats=11, vel_acc=250, lat=-353632610
):
    return mavlink.MAVLink_gps_raw_int_message(
        time_usec, fix, lat, 1491652299, 584090, eph, 200, vel, cog, sats, 0, 900, 1200, vel_acc
    )


class TestInertial:
    def test_raw_imu_is_milli_g_of_the_standard_gravity(self, decoder):
        (sample,) = decode(decoder, raw_imu(10_010_000, (1000, -500, -1000), (100, 0, -1), 2503))
        assert sample == ImuSample(
            t=pytest.approx(10.01),
            imu=1,
            f_b=pytest.approx((9.80665, -4.903325, -9.80665)),
            w_b=pytest.approx((0.1, 0.0, -0.001)),
            temperature=pytest.approx(25.03),
            f_step=MILLI_G,
            w_step=1e-3,
            source=ImuSource.RAW_IMU,
        )

    def test_temperature_zero_means_not_known(self, decoder):
        assert decode(decoder, raw_imu(10_010_000))[0].temperature is None
        assert decode(decoder, raw_imu(10_010_000, temperature=-500))[0].temperature == -5.0

    def test_an_accelerometer_that_is_all_zeros_is_absent(self, decoder):
        assert decode(decoder, raw_imu(10_010_000, (0, 0, 0), (0, 0, 0))) == ()
        assert decoder.refused == {"RAW_IMU: absent": 1}

    @pytest.mark.parametrize(
        ("kind", "imu"),
        [
            (mavlink.MAVLink_scaled_imu_message, 1),
            (mavlink.MAVLink_scaled_imu2_message, 2),
            (mavlink.MAVLink_scaled_imu3_message, 3),
        ],
    )
    def test_scaled_imu_is_the_same_in_milliseconds(self, decoder, kind, imu):
        (sample,) = decode(decoder, kind(10_020, 1000, 0, -1000, 1, 2, 3, 0, 0, 0, -1250))
        assert (sample.t, sample.imu, sample.source) == (10.02, imu, ImuSource.SCALED_IMU)
        assert sample.f_b == pytest.approx((9.80665, 0.0, -9.80665))
        assert sample.f_step == MILLI_G
        assert sample.temperature == pytest.approx(-12.5)

    def highres(self, f=(0.25, -0.5, -9.75), fields=0x1FFF, number=0):
        return mavlink.MAVLink_highres_imu_message(
            10_030_000, *f, 0.5, 0.25, 0.125, 0, 0, 0, 945.0, 0, 0, 25.4, fields, number
        )

    def test_highres_imu_is_exact_and_its_temperature_is_the_barometers(self, decoder):
        (sample,) = decode(decoder, self.highres())
        assert sample == ImuSample(
            t=pytest.approx(10.03),
            imu=1,
            f_b=(0.25, -0.5, -9.75),
            w_b=(0.5, 0.25, 0.125),
            source=ImuSource.HIGHRES_IMU,
        )
        assert decode(decoder, self.highres(number=1))[0].imu == 2

    def test_highres_imu_says_which_fields_it_has(self, decoder):
        assert decode(decoder, self.highres(fields=0x1FC0)) == ()
        assert decode(decoder, self.highres(fields=0x0007))[0].w_b is None

    def test_numbers_that_are_not_finite_are_refused_and_counted(self, decoder):
        assert decode(decoder, self.highres((math.nan, 0.0, 0.0))) == ()
        assert decode(decoder, attitude(10_040, roll=math.inf)) == ()
        assert sum(decoder.refused.values()) == 2

    def test_attitude(self, decoder):
        assert decode(decoder, attitude(10_050)) == (AttitudeSample(10.05, 0.125, 0.25, 0.5),)


class TestGps:
    def test_a_fix(self, decoder):
        (fix,) = decode(decoder, gps())
        assert fix == GpsFix(
            t=pytest.approx(9.88),
            receiver=1,
            fix_type=3,
            latitude=pytest.approx(math.radians(-35.3632610)),
            longitude=pytest.approx(math.radians(149.1652299)),
            altitude=pytest.approx(584.09),
            v_n=pytest.approx(0.0, abs=1e-12),
            v_e=pytest.approx(20.0),
            satellites=11,
            hdop=pytest.approx(1.2),
            speed_accuracy=pytest.approx(0.25),
            speed_step=0.01,
        )

    @given(st.integers(0, 30_000), st.integers(0, 35_999))
    def test_speed_and_course_make_the_velocity(self, vel, cog):
        decoder = Decoder(1, 1)
        (fix,) = decode(decoder, gps(vel=vel, cog=cog))
        assert math.hypot(fix.v_n, fix.v_e) == pytest.approx(vel / 100)
        if vel:
            assert math.degrees(math.atan2(fix.v_e, fix.v_n)) % 360 == pytest.approx(
                cog / 100, abs=1e-6
            )

    def test_what_the_receiver_does_not_know_is_none(self, decoder):
        (fix,) = decode(decoder, gps(eph=65535, sats=255, vel_acc=0))
        assert (fix.hdop, fix.satellites, fix.speed_accuracy) == (None, None, None)

    def test_without_velocity_a_fix_is_no_use(self, decoder):
        assert decode(decoder, gps(vel=65535)) == ()
        assert decode(decoder, gps(cog=65535)) == ()
        (still,) = decode(decoder, gps(vel=0, cog=65535))
        assert (still.v_n, still.v_e) == (0.0, 0.0)

    def test_no_fix_is_told_with_the_time_of_now(self, decoder):
        (fix,) = decode(decoder, gps(time_usec=0, fix=1, vel=65535, cog=65535))
        assert (fix.fix_type, fix.v_n, fix.v_e) == (1, 0.0, 0.0)
        assert fix.t == decoder.clock.latest == 10.0

    def test_an_old_fix_is_not_a_reboot(self, decoder):
        for _ in range(5):
            decode(decoder, gps(time_usec=2_000_000))
        assert decoder.clock.reboots == 0
        assert decoder.clock.latest == 10.0

    def test_the_second_receiver(self, decoder):
        message = mavlink.MAVLink_gps2_raw_message(
            9_900_000, 4, 1, 2, 3000, 80, 90, 100, 0, 17, 0, 0, vel_acc=120
        )
        (fix,) = decode(decoder, message)
        assert (fix.receiver, fix.v_n, fix.speed_accuracy) == (2, 1.0, pytest.approx(0.12))


class TestStatus:
    @pytest.mark.parametrize(
        ("mav_type", "kind"), [(2, "copter"), (14, "copter"), (1, "plane"), (10, "rover"), (0, "")]
    )
    def test_what_kind_of_vehicle_it_is(self, decoder, mav_type, kind):
        message = mavlink.MAVLink_heartbeat_message(mav_type, 3, 1, 0, 4, 3)
        (state,) = decode(decoder, message)
        assert state.kind == kind

    def test_armed_and_landed(self, decoder):
        for mode, armed in ((0x80 | 1, True), (1, False)):
            (state,) = decode(decoder, heartbeat(base_mode=mode))
            assert (state.t, state.armed, state.landed) == (10.0, armed, None)
        landed = [
            [s.landed for s in decode(decoder, mavlink.MAVLink_extended_sys_state_message(0, n))]
            for n in range(5)
        ]
        assert landed == [[], [True], [False], [False], [False]]

    def test_ekf_and_vibration(self, decoder):
        ekf = mavlink.MAVLink_ekf_status_report_message(0x8000 | 831, 0, 0, 0, 0, 0)
        assert decode(decoder, ekf) == (EkfHealth(10.0, 0x8000 | 831),)
        vibration = mavlink.MAVLink_vibration_message(10_500_000, 1.5, 2.5, 3.5, 7, 8, 9)
        assert decode(decoder, vibration) == (Vibration(10.5, (1.5, 2.5, 3.5), (7, 8, 9)),)

    def test_throttle_and_air(self, decoder):
        hud = mavlink.MAVLink_vfr_hud_message(17.5, 18.0, 90, 63, 100.0, 0.0)
        assert decode(decoder, hud) == (Throttle(10.0, 0.63), AirData(10.0, airspeed=17.5))

    def test_wind_blows_away_from_where_it_comes_from(self, decoder):
        west_wind = mavlink.MAVLink_wind_message(-90.0, 5.0, 3.0)
        (air,) = decode(decoder, west_wind)
        assert air.wind_e == pytest.approx(4.0)  # the speed is that of the 3D vector
        assert air.wind_n == pytest.approx(0.0, abs=1e-12)

    def test_battery(self, decoder):
        status = mavlink.MAVLink_sys_status_message(0, 0, 0, 0, 12600, 1872, 90, 0, 0, 0, 0, 0, 0)
        assert decode(decoder, status) == (Battery(10.0, 12.6, 18.72),)
        cells = [4200, 4100] + [65535] * 8
        battery = mavlink.MAVLink_battery_status_message(0, 0, 0, 32767, cells, -1, 0, 0, 90)
        assert decode(decoder, battery) == (Battery(10.0, pytest.approx(8.3), None),)
        assert decode(decoder, status) == (), "the first battery twice"

    def test_parameters(self, decoder):
        message = mavlink.MAVLink_param_value_message(b"INS_ACCOFFS_X", 0.25, 9, 1000, 65535)
        assert decode(decoder, message) == (ParameterValue("INS_ACCOFFS_X", 0.25, 10.0),)

    def test_a_full_length_name_has_no_end_mark(self, decoder):
        message = mavlink.MAVLink_param_value_message(b"ABCDEFGHIJKLMNOP", 1.0, 9, 1, 0)
        assert decode(decoder, message)[0].name == "ABCDEFGHIJKLMNOP"


class TestSource:
    def test_nothing_comes_out_before_the_autopilot_is_known(self):
        decoder = Decoder()
        assert decoder.decode(received(attitude(1000))) == ()
        assert decoder.source is None

    @pytest.mark.parametrize("other", [heartbeat(6, 8), heartbeat(26, 8), heartbeat(6, 3)])
    def test_stations_and_gimbals_are_not_autopilots(self, other):
        decoder = Decoder()
        decoder.decode(received(other, system=255, component=190))
        assert decoder.source is None

    def test_other_components_and_vehicles_are_ignored(self, decoder):
        for source in ((1, 154), (2, 1), (1, 191)):
            assert decoder.decode(received(heartbeat(base_mode=0x80), *source)) == ()
            assert decoder.decode(received(attitude(20_000), *source)) == ()
        assert decoder.clock.latest == 10.0

    def test_parameters_told_before_the_first_heartbeat_are_not_lost(self):
        decoder = Decoder()
        for source, value in (((1, 1), 0.5), ((1, 191), 7.0), ((1, 1), 0.25)):
            message = mavlink.MAVLink_param_value_message(b"GPS1_POS_X", value, 9, 1000, 65535)
            assert decoder.decode(received(message, *source)) == ()
        assert decoder.decode(received(heartbeat())) == (ParameterValue("GPS1_POS_X", 0.25, None),)
        assert decode(decoder, heartbeat()) == ()

    def test_a_system_asked_for_is_waited_for(self):
        decoder = Decoder(system=2)
        decoder.decode(received(heartbeat(), system=1))
        assert decoder.source is None
        decoder.decode(received(heartbeat(), system=2))
        assert decoder.source == (2, 1)


def test_the_names_are_the_messages_decoded():
    assert set(Decoder.names) <= set(MESSAGE_IDS)


@given(st.data())
def test_any_content_of_any_message_decodes_or_is_refused(data):
    decoder = Decoder(1, 1)
    decoder.decode(received(attitude(10_000)))
    kind = mavlink.mavlink_map[MESSAGE_IDS[data.draw(st.sampled_from(Decoder.names))]]
    payload = data.draw(st.binary(min_size=kind.unpacker.size, max_size=kind.unpacker.size))
    sender = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    message = mavlink.MAVLink_message(kind.id if isinstance(kind.id, int) else 0, kind.msgname)
    wire = message._pack(sender, kind.crc_extra, payload)
    (frame,) = Codec().feed(wire)
    for sample in decoder.decode(frame.message):
        if isinstance(sample, ImuSample):
            assert all(map(math.isfinite, sample.f_b))
        if isinstance(sample, GpsFix):
            assert math.isfinite(sample.v_n)
            assert math.isfinite(sample.v_e)


class TestBodyAttitude:
    """A tailsitter's ATTITUDE is of a view in hover, ATTITUDE_QUATERNION of the body always."""

    @staticmethod
    def parameter(name, value):
        kind = mavlink.MAV_PARAM_TYPE_REAL32
        return mavlink.MAVLink_param_value_message(name.encode(), value, kind, 1, 0)

    @staticmethod
    def quaternion(ms, *q):
        return mavlink.MAVLink_attitude_quaternion_message(ms, *q, 0.0, 0.0, 0.0)

    @pytest.fixture
    def tailsitter(self, decoder):
        decode(decoder, self.parameter("Q_ENABLE", 1.0))
        decode(decoder, self.parameter("Q_TAILSIT_ENABLE", 1.0))
        return decoder

    @given(st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1))
    def test_it_is_the_same_rotation(self, q):
        decoder = Decoder()
        decode(decoder, heartbeat())
        decode(decoder, self.parameter("Q_ENABLE", 1.0))
        decode(decoder, self.parameter("Q_TAILSIT_ENABLE", 1.0))
        unit = np.array(q) / np.linalg.norm(q)
        (sample,) = decode(decoder, self.quaternion(10_000, *unit))
        assert sample.turned
        made = rotation_from_euler(sample.roll, sample.pitch, sample.yaw)
        np.testing.assert_allclose(made, rotation_from_quaternion(unit), atol=2e-6)

    def test_the_view_is_left_out_while_the_body_is_told(self, tailsitter):
        assert decode(tailsitter, attitude(10_020))  # better than nothing
        up = math.sqrt(0.5)
        assert decode(tailsitter, self.quaternion(10_040, up, 0.0, up, 0.0))[0].turned
        assert decode(tailsitter, attitude(10_060)) == ()
        assert decode(tailsitter, attitude(14_000))

    def test_what_is_no_rotation_is_refused(self, tailsitter):
        assert decode(tailsitter, self.quaternion(10_040, 0.0, 0.0, 0.0, 0.0)) == ()
        assert decode(tailsitter, self.quaternion(10_060, math.nan, 0.0, 0.0, 1.0)) == ()
        assert tailsitter.refused == {"ATTITUDE_QUATERNION: no rotation": 2}

    def test_others_tell_it_by_angles(self, decoder):
        assert decode(decoder, self.quaternion(10_040, 1.0, 0.0, 0.0, 0.0)) == ()
        assert not decode(decoder, attitude(10_060))[0].turned
