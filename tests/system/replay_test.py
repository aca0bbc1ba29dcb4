#!/usr/bin/python3
"""A flight recorded by lcm-logger gives the same events at the same times: replayed by lcm-logplayer, and in airworthy eval."""
import csv
import importlib
import json
import pathlib
import struct
import subprocess
import sys
import time

import system_test
from system_test import BINARIES, PROJECT, SystemTest, flights

SPEED = 10.0
FLIGHTS = ("carbonZ_2018-10-18-11-03-57_engine_failure_with_emr_traj", "carbonZ_2018-09-11-15-06-34_1_rudder_right_failure")
VEHICLE = "plane1"
TYPES = {"FAULT_EVENT": "fault_event_t", "DRIVER_STATUS": "driver_status_t", "IMU": "imu_t"}


def python_bindings(folder):
    """Decoders made by lcm-gen: independent of our C++."""
    subprocess.run(["lcm-gen", "-p", "--ppath", folder, *(PROJECT / "lcmtypes").glob("*.lcm")], check=True)
    sys.path.insert(0, str(folder))
    package = importlib.import_module("airworthy")
    return {channel: getattr(package, name) for channel, name in TYPES.items()}


def read_log(path):
    """Yields (event number, channel, payload) of an LCM log."""
    data, offset = pathlib.Path(path).read_bytes(), 0
    while offset + 28 <= len(data):
        sync, number, _, channel_length, size = struct.unpack(">Iqqii", data[offset:offset + 28])
        assert sync == 0xEDA1DA01, f"{path}: byte {offset}"
        offset += 28
        channel = data[offset:offset + channel_length].decode()
        offset += channel_length
        yield number, channel, data[offset:offset + size]
        offset += size


def lost_messages(path):
    """Numbers missing in the headers of each producer and channel: what sender or logger lost."""
    last, lost = {}, 0
    for _, channel, payload in read_log(path):
        if not channel.startswith(f"{VEHICLE}/"):
            continue  # LCM's own self test
        _, _, seq, length = struct.unpack(">qqqi", payload[8:36])
        producer = payload[36:36 + length]
        session = struct.unpack(">q", payload[36 + length:44 + length])[0]
        key = (channel, producer, session)
        if key in last:
            lost += seq - last[key] - 1
        last[key] = seq
    return lost


def events(path, bindings):
    """What was decided, without who decided it and when it was sent."""
    decided = []
    for _, channel, payload in read_log(path):
        if channel != f"{VEHICLE}/FAULT_EVENT":
            continue
        event = bindings["FAULT_EVENT"].decode(payload)
        decided.append((event.number, event.phase, event.component, event.fault_kind, event.onset_us,
                        event.detected_us, event.header.time_us, event.magnitude,
                        tuple((item.name, item.value) for item in event.evidence)))
    return decided


class Replay(SystemTest):
    def setUp(self):
        self.rigs = []

    def record(self, rig, name):
        log = rig.path / name
        rig.start("lcm-logger", ["lcm-logger", "--quiet", "--force", f"--lcm-url={rig.lcm_url}", log])
        time.sleep(0.3)
        return log

    def fly(self, name, driver_overrides=()):
        rig = self.rig(SPEED)
        feed = self.feed(rig)
        log = self.record(rig, "live.lcm")
        self.start_system(rig, feed, driver_overrides)
        flight = rig.start_flight(flights(name)[name], "--start-delay", "1.0")
        while flight.poll() is None:
            feed.poll(0.2)
        time.sleep(0.5)
        self.assert_alive(rig)
        summary = json.loads((rig.path / "flight.json").read_text())
        rig.stop_all()
        return rig, log, summary

    def replay(self, live):
        rig = self.rig(1.0, clock_of_detectors="tick")
        feed = self.feed(rig)
        log = self.record(rig, "again.lcm")
        rig.start_gateway()
        rig.start_response()
        time.sleep(1.0)
        self.assert_alive(rig)
        inputs = subprocess.run(["/usr/bin/python3", PROJECT / "tools/generate_channels.py", "regex",
                                 PROJECT / "lcmtypes/channels.toml", "input", VEHICLE],
                                check=True, capture_output=True, text=True).stdout.strip()
        player = rig.start("lcm-logplayer", ["lcm-logplayer", "-e", inputs, "-l", rig.lcm_url, live])
        while player.poll() is None:
            feed.poll(0.2)
        time.sleep(0.5)
        self.assertEqual(player.returncode, 0)
        rig.running.pop("lcm-logplayer")
        self.assert_alive(rig)
        rig.stop_all()
        return log, feed

    def alarms_of_eval(self, log):
        """The faults that airworthy eval raises over a recording: component, kind, onset, detection."""
        done = subprocess.run([BINARIES / "airworthy-eval", "--json", "--config", PROJECT / "config/response.toml", log],
                              check=True, capture_output=True, text=True)
        return [(alarm["component"], alarm["fault_kind"], alarm["onset_us"], alarm["time_us"])
                for alarm in json.loads(done.stdout)["flights"][0]["alarms"]]

    def test_the_same_events_again(self):
        for name in FLIGHTS:
            with self.subTest(name):
                rig, live, _ = self.fly(name)
                bindings = python_bindings(rig.path)
                again, feed = self.replay(live)
                first, second = events(live, bindings), events(again, bindings)
                print(f"{name}: {len(first)} events; lost on the way to the logger: live {lost_messages(live)}, "
                      f"replay {lost_messages(again)}")
                self.assertGreater(len(first), 0)
                self.assertEqual(first, second)
                raised = [(component, kind, onset_us, detected_us)
                          for _, phase, component, kind, onset_us, detected_us, *_ in second if phase == 1]
                self.assertEqual(self.alarms_of_eval(live), raised)
                self.assertEqual([event["number"] for event in feed.events()],
                                 [number for number, phase, *_ in second if phase == 1])

    def test_frames_per_message_equal_an_independent_count(self):
        rig, live, summary = self.fly(FLIGHTS[1], ["autopilot.system_id=1"])
        bindings = python_bindings(rig.path)
        statuses = [bindings["DRIVER_STATUS"].decode(payload) for _, channel, payload in read_log(live)
                    if channel == f"{VEHICLE}/DRIVER_STATUS"]
        counters = {counter.name: counter.value for counter in statuses[-1].counters}
        print(json.dumps(counters))
        counted = {rate.name: rate.count for rate in statuses[-1].rates}
        self.assertEqual(sum(counted.values()), summary["packets"])
        with open(system_test.DATA / "mavlink_ref/crc_extra.csv", encoding="utf-8") as file:
            names = {row["msgid"]: row["name"] for row in csv.DictReader(file)}
        self.assertEqual(counted, {names[message]: count for message, count in summary["per_message"].items()})
        self.assertEqual(counters["parser.crc_errors"], 0)


if __name__ == "__main__":
    system_test.main()
