"""The MCAP file, read by a reader that knows nothing of the writer but the format."""

import json
import struct

import numpy as np
import pytest

from onboard.core.physics.finding import Imprint
from onboard.report.mcap import MAGIC, Track, mcap
from onboard.report.tracks import of_diagnosis, of_replay
from tests.report.diagnoses_by_hand import diagnosis, effect
from tests.web.reports import replayed


class Cursor:
    """Reads little-endian numbers and strings with their lengths."""

    def __init__(self, data):
        self.data, self.at = data, 0

    def number(self, form):
        (value,) = struct.unpack_from("<" + form, self.data, self.at)
        self.at += struct.calcsize("<" + form)
        return value

    def bytes(self, size=None):
        size = self.number("I") if size is None else size
        found = self.data[self.at : self.at + size]
        assert len(found) == size
        self.at += size
        return found


def read(data):
    """Messages by topic: (time in s, mapping); checks order and ends."""
    assert data.startswith(MAGIC)
    assert data.endswith(MAGIC)
    outer = Cursor(data[len(MAGIC) : -len(MAGIC)])
    schemas, topics, messages, kinds, last = {}, {}, {}, [], 0
    while outer.at < len(outer.data):
        kind = outer.number("B")
        inner = Cursor(outer.bytes(outer.number("Q")))
        kinds.append(kind)
        if kind == 0x03:
            number = inner.number("H")
            _, encoding, schema = inner.bytes(), inner.bytes(), inner.bytes()
            assert encoding == b"jsonschema"
            schemas[number] = json.loads(schema)
        elif kind == 0x04:
            number, schema = inner.number("H"), inner.number("H")
            topic, encoding, metadata = inner.bytes().decode(), inner.bytes(), inner.bytes()
            assert (encoding, metadata) == (b"json", b"")
            topics[number] = (topic, schemas[schema])
            messages[topic] = []
        elif kind == 0x05:
            number, count = inner.number("H"), inner.number("I")
            logged, published = inner.number("Q"), inner.number("Q")
            assert logged == published >= last
            last = logged
            topic, schema = topics[number]
            said = json.loads(inner.data[inner.at :])
            assert said.keys() <= schema["properties"].keys()
            assert count == sum(map(len, messages.values()))
            messages[topic].append((logged / 1e9, said))
    assert kinds[0] == 0x01
    assert kinds[-2:] == [0x0F, 0x02]
    return messages


def test_what_is_read_is_what_was_written_and_gaps_are_left_out():
    t = np.array([0.25, 0.5, 1.0])
    one = Track("/a/b", t, {"x": np.array([1.0, np.nan, -3.5]), "y": np.full(3, np.nan)})
    two = Track("/c", t[:1] + 0.1, {"z": np.array([1e-9])})
    found = read(mcap([one, two]))
    assert found["/a/b"] == [(0.25, {"x": 1.0}), (1.0, {"x": -3.5})]
    assert found["/c"] == [(pytest.approx(0.35), {"z": 1e-9})]


def test_no_message_at_all_is_a_file_too():
    assert read(mcap([])) == {}


def test_a_diagnosis_has_its_residual_and_what_effects_make_of_it():
    t = np.arange(50) * 0.2
    imprint = Imprint("earth_east", t, np.sin(t), 0.9 * np.sin(t))
    made = diagnosis(effects=(effect(imprint=imprint),))
    found = read(mcap(of_diagnosis(made)))
    series = made.series
    by_time = {round(at * 1e9): said for at, said in found["/onboard/imu1/velocity_residual"]}
    checked = 0
    for at, east in zip(series.t, series.after[:, 1], strict=True):
        if np.isfinite(east):
            assert by_time[round(at * 1e9)]["east_after"] == east
            checked += 1
    assert checked > 100
    name = made.effects[0].name
    drawn = found[f"/onboard/imu1/effect/{name}/earth_east"]
    np.testing.assert_allclose([said["effect"] for _, said in drawn], imprint.made)
    np.testing.assert_allclose([said["data"] for _, said in drawn], imprint.left)


@pytest.mark.slow
def test_a_replay_ends_at_its_answer():
    result, chronicle = replayed()
    found = read(mcap(of_replay(result, chronicle)))
    for answer in result.answers:
        _, last = found[f"/onboard/imu{answer.imu}/estimate"][-1]
        assert last["x_scale"] == pytest.approx(answer.calibration.scale[0])
        assert last["z_offset_sigma"] == pytest.approx(answer.calibration.offset_sigma[2])
        assert len(found[f"/onboard/imu{answer.imu}/velocity_error/after"]) > 10
    assert len(found["/onboard/speed"]) > 10
