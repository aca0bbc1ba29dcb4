#!/usr/bin/python3
"""Imports recorded flights with airworthy-import and counts and decodes the result without any code of the project.

  import_system_test.py AIRWORTHY-IMPORT CONFIG-FOLDER DATA-FOLDER

DATA-FOLDER may be overridden by AIRWORTHY_DATA; where neither exists nothing is tested.
"""
import csv
import hashlib
import json
import lzma
import math
import os
import pathlib
import signal
import struct
import subprocess
import sys
import tempfile
import unittest

SKIPPED = 77
ENGINE = "carbonZ_2018-09-11-14-22-07_1_engine_failure"
HEALTHY = "carbonZ_2018-09-11-14-16-55_no_failure"
TWO_AILERONS = "carbonZ_2018-09-11-14-52-54_left_aileron__right_aileron__failure"


def rows(path):
    opener = lzma.open if path.suffix == ".xz" else open
    with opener(path, "rt", newline="") as file:
        return list(csv.DictReader(file))


def events(path):
    """(time of the event, channel, payload) of an LCM log, from the format's description alone."""
    data = path.read_bytes()
    offset = number = 0
    while offset < len(data):
        sync, event, time_us, channel_size, size = struct.unpack_from(">IqqII", data, offset)
        assert sync == 0xEDA1DA01 and event == number, (offset, hex(sync), event)
        offset += 28
        channel = data[offset:offset + channel_size].decode()
        offset += channel_size
        yield time_us, channel, data[offset:offset + size]
        offset += size
        number += 1


class Message:
    """A decoded payload: header, then the rest read on demand."""

    def __init__(self, payload):
        self.payload, self.offset = payload, 8
        self.time_us, self.sent_us, self.seq = self.read(">qqq")
        self.producer = self.text()
        (self.session,) = self.read(">q")

    def read(self, form):
        values = struct.unpack_from(form, self.payload, self.offset)
        self.offset += struct.calcsize(form)
        return values

    def text(self):
        (size,) = self.read(">i")
        value = self.payload[self.offset:self.offset + size - 1].decode()
        self.offset += size
        return value


def channel(path, name):
    return [Message(payload) for _, found, payload in events(path) if found.endswith("/" + name)]


class Import(unittest.TestCase):
    program = config = data = None

    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)

    def run_import(self, *arguments, expect=0):
        run = subprocess.run([self.program, *map(str, arguments)], capture_output=True, text=True, check=False, timeout=60)
        self.assertEqual(run.returncode, expect, run.stderr)
        return run

    def import_alfa(self, *sequences):
        run = self.run_import("alfa", *[self.data / "alfa" / name for name in sequences], "-o", self.folder / "alfa", "--json")
        return {pathlib.Path(log["log"]).stem: log for log in json.loads(run.stdout)["logs"]}

    def test_every_alfa_sequence_has_the_messages_of_its_tables(self):
        sequences = sorted(path.name for path in (self.data / "alfa").iterdir() if path.is_dir())
        logs = self.import_alfa(*sequences)
        self.assertEqual(sorted(logs), sequences)
        for name in sequences:
            folder = self.data / "alfa" / name
            tables = {topic: rows(folder / f"{topic}.csv.xz")
                      for topic in ("imu-data_raw", "vfr_hud", "nav_info-roll", "nav_info-pitch", "nav_info-errors")}
            found = logs[name]["messages"]
            self.assertEqual(found["alfa/IMU"], len(tables["imu-data_raw"]), name)
            self.assertEqual(found["alfa/FLIGHT_STATE"], len(tables["vfr_hud"]) + len(tables["nav_info-errors"]), name)
            # Rows of roll and pitch less than 5 ms apart are one packet.
            stamps = sorted((int(row["field.header.stamp"]), topic, row["field.measured"])
                            for topic in ("nav_info-roll", "nav_info-pitch") for row in tables[topic])
            packets = []
            for stamp, topic, measured in stamps:
                if not packets or stamp - packets[-1][0] > 5_000_000 or topic in packets[-1][1]:
                    packets.append((stamp, {}))
                packets[-1][1][topic] = measured
            self.assertEqual(found["alfa/ATTITUDE_SETPOINT"], len(packets), name)
            fresh, last = 0, {}
            for _, measured in packets:
                fresh += any(topic in last and last[topic] != value for topic, value in measured.items())
                last.update(measured)
            self.assertEqual(found["alfa/ATTITUDE"], fresh, name)
            faults = {(path.name, row["field.data"]) for path in folder.glob("failure_status-*.csv") for row in rows(path)}
            truths = sum(2 if topic.endswith("aileron.csv") and code == "3" else 1 for topic, code in faults)
            self.assertEqual(found.get("alfa/GROUND_TRUTH", 0), truths or int("no_failure" in name), name)

    def test_the_values_of_an_alfa_flight_are_those_of_its_table(self):
        self.import_alfa(ENGINE)
        log = self.folder / "alfa" / f"{ENGINE}.lcm"
        times = [time_us for time_us, _, _ in events(log)]
        self.assertEqual(times, sorted(times))
        imu = channel(log, "IMU")
        table = rows(self.data / "alfa" / ENGINE / "imu-data_raw.csv.xz")
        names = [f"field.{kind}.{axis}" for kind in ("linear_acceleration", "angular_velocity") for axis in "xyz"]
        for number, (message, row) in enumerate(zip(imu, table)):
            self.assertEqual((message.time_us, message.sent_us, message.seq),
                             (int(row["field.header.stamp"]) // 1000,) * 2 + (number,))
            self.assertEqual((message.producer, message.session), ("airworthy-import", imu[0].session))
            values = message.read(">b6d")
            x, y, z, p, q, r = (float(row[name]) for name in names)
            self.assertEqual(values, (0, x, -y, -z, p, -q, -r))
        mean_az = sum(struct.unpack_from(">d", message.payload, message.offset - 32)[0] for message in imu) / len(imu)
        self.assertLess(mean_az, -8.0)
        (truth,) = channel(log, "GROUND_TRUTH")
        onset_us = 1536690374324825782 // 1000
        self.assertEqual((truth.text(), truth.text(), truth.read(">q")), ("engine", "thrust_loss", (onset_us,)))

    def test_the_second_aileron_has_an_onset_of_its_own(self):
        self.import_alfa(TWO_AILERONS)
        truths = [(message.text(), message.text(), message.read(">q")[0])
                  for message in channel(self.folder / "alfa" / f"{TWO_AILERONS}.lcm", "GROUND_TRUTH")]
        self.assertEqual(truths, [("left aileron", "stuck", 1536692249985030), ("right aileron", "stuck", 1536692321492913)])

    def test_the_same_flight_from_mavlink_says_the_same(self):
        self.import_alfa(ENGINE, HEALTHY)
        for name in (ENGINE, HEALTHY):
            self.run_import("tlog", self.data / "alfa_mavlink" / f"{name}.tlog.xz", "--truth", self.data / "alfa" / "index.csv",
                            "-o", self.folder / "tlog")
            by_csv, by_tlog = self.folder / "alfa" / f"{name}.lcm", self.folder / "tlog" / f"{name}.lcm"
            for kind, form, tolerance in (("IMU", ">b6d", 0.011), ("ATTITUDE", ">2d", 1e-6), ("ATTITUDE_SETPOINT", ">2d", 1e-6)):
                left = [(message.time_us, message.read(form)) for message in channel(by_csv, kind)]
                right = [(message.time_us, message.read(form)) for message in channel(by_tlog, kind)]
                right = [(time_us, values) for time_us, values in right if form != ">b6d" or values[0] == 0]
                # Every message of the one has its like in the other, at most 0.2 s away.
                start = max(left[0][0], right[0][0]) + 1_000_000
                end = min(left[-1][0], right[-1][0]) - 1_000_000
                checked = 0
                for time_us, values in right:
                    if not start <= time_us <= end:
                        continue
                    near = [other for other_us, other in left if abs(other_us - time_us) < 200_000]
                    self.assertTrue(any(all(math.isclose(a, b, abs_tol=tolerance) for a, b in zip(values, other))
                                        for other in near), (name, kind, time_us, values, near))
                    checked += 1
                self.assertGreater(checked, 0.9 * len([1 for time_us, _ in left if start <= time_us <= end]), (name, kind))
            truth = [[message.payload[message.offset:] for message in channel(log, "GROUND_TRUTH")] for log in (by_csv, by_tlog)]
            self.assertEqual(*truth)

    def test_the_same_input_gives_the_same_bytes(self):
        digests = set()
        for _ in range(2):
            self.import_alfa(ENGINE)
            self.run_import("tlog", self.data / "alfa_mavlink" / f"{ENGINE}.tlog.xz", "-o", self.folder / "tlog")
            digests.add(tuple(hashlib.sha256(log.read_bytes()).hexdigest() for log in sorted(self.folder.rglob("*.lcm"))))
        self.assertEqual(len(digests), 1)
        self.assertEqual(len(digests.pop()), 2)

    def import_table(self, name, map_name, *arguments):
        log = self.folder / "table.lcm"
        run = self.run_import("table", self.data / name, "--map", self.config / "import" / map_name, "-o", log, "--json",
                              *arguments)
        return log, json.loads(run.stdout)["logs"][0]

    def mean(self, log, kind, form, index):
        values = [message.read(form)[index] for message in channel(log, kind)]
        values = [value for value in values if not math.isnan(value)]
        return sum(values) / len(values)

    def test_the_maps_bring_every_set_to_forward_right_down(self):
        # At rest and in level flight the specific force along z is -9.8.
        for name, map_name in (
                ("indiflight_throw/LOG00257.csv.xz", "indiflight_throw.toml"),
                ("crazyflie_brushless_rpm/square_run2.csv.xz", "crazyflie_brushless_rpm.toml"),
                ("crazypad/motor/normal_flight__E8_log01.csv.xz", "crazypad_motor.toml"),
                ("crazypad/controller/normal_flight__E8_log00.csv.xz", "crazypad_controller.toml"),
                ("daredevil_faults/20_07_10__06_53_03", "daredevil_faults.toml"),
                ("bebop2_prop_eject/flight01_11-43-10.csv.xz", "bebop2_prop_eject.toml"),
                ("rflymad_sim/TestCase_7_2000000006", "rflymad_sim.toml")):
            log, summary = self.import_table(name, map_name)
            mean_az = self.mean(log, "IMU", ">b6d", 3)
            self.assertGreater(mean_az, -13.0, name)
            self.assertLess(mean_az, -5.0, name)
            self.assertIn("GROUND_TRUTH", " ".join(summary["messages"]), name)

    def test_truth_of_the_sets(self):
        def truths(name, map_name, *arguments):
            log, _ = self.import_table(name, map_name, *arguments)
            return [(message.text(), message.text(), *message.read(">qd")) for message in channel(log, "GROUND_TRUTH")]
        ((component, kind, onset_us, _),) = truths("bebop2_prop_eject/flight01_11-43-10.csv.xz", "bebop2_prop_eject.toml")
        self.assertEqual((component, kind, onset_us), ("rotor 2", "propeller_lost", 518335767 + 12390000))
        self.assertEqual(truths("rflymad_sim/TestCase_3_2000000002", "rflymad_sim.toml"),
                         [("rotor 1", "loss_of_effectiveness", 54415792, 0.8)])
        found = truths("crazypad/controller/tape_on_propeller_M1_M3__E9_log02.csv.xz", "crazypad_controller.toml")
        self.assertEqual([item[:2] for item in found], [("rotor 1", "propeller_unbalance"), ("rotor 3", "propeller_unbalance")])
        found = truths("daredevil_faults/20_07_10__06_53_03", "daredevil_faults.toml")
        self.assertEqual(found[0], ("right elevon", "loss_of_effectiveness", 552416000, 0.5))
        self.assertEqual([item[1] for item in found], ["loss_of_effectiveness", "none"] * 3)
        found = truths("daredevil_faults/20_07_10__06_53_03", "daredevil_faults.toml", "--from", "600", "--until", "720")
        self.assertEqual([item[1:3] for item in found], [("loss_of_effectiveness", found[0][2]), ("none", -1)])
        self.assertAlmostEqual(found[0][2] / 1e6, 600.0, delta=1.0)

    def test_damage_leaves_nothing_behind(self):
        whole = (self.data / "alfa_mavlink" / f"{HEALTHY}.tlog.xz").read_bytes()
        packets = lzma.decompress(whole)
        first = 8 + 8 + packets[9]  # time, then a frame of version 1: header 6, payload, checksum 2
        damaged = bytearray(packets)
        damaged[first + 8 + 7] ^= 0x40
        later = bytearray(packets)
        later[:8] = struct.pack(">q", struct.unpack_from(">q", packets)[0] + 3_600_000_000)
        for name, content, message in (
                ("cut.tlog.xz", whole[:-100], f": byte {len(whole) - 100}: truncated xz data"),
                ("cut.tlog", packets[:-1], "truncated record"),
                ("empty.tlog", b"", ": the file is empty"),
                ("text.tlog", b"this is no telemetry log at all, though long enough", ": byte 0: no record of a telemetry log"),
                ("damaged.tlog", bytes(damaged), f": byte {first}: packet with a wrong checksum"),
                ("later.tlog", bytes(later), f": byte {first}: time goes backward by 3")):
            path = self.folder / name
            path.write_bytes(content)
            run = self.run_import("tlog", path, "-o", self.folder / "out", expect=65)
            self.assertEqual(len(run.stderr.splitlines()), 1, run.stderr)
            self.assertIn(message, run.stderr)
            self.assertIn(str(path), run.stderr)
            self.assertFalse((self.folder / "out").exists(), name)

    def test_an_interrupted_import_leaves_nothing_behind(self):
        map_file = self.folder / "map.toml"
        map_file.write_text('vehicle = "v"\n[[table]]\ntime = {column = "t", unit = "s"}\n[[table.message]]\nchannel = "IMU"\n'
                            'fields = [{field = "accel_m_s2[0]", column = "x"}]\n')
        log = self.folder / "flight.lcm"
        long = self.folder / "long.csv"
        with open(long, "w", encoding="ascii") as file:
            file.write("t,x\n")
            for number in range(2_000_000):
                file.write(f"{number},1\n")
        with subprocess.Popen([self.program, "table", str(long), "--map", str(map_file), "-o", str(log)],
                              stderr=subprocess.PIPE, text=True) as run:
            partial = pathlib.Path(str(log) + ".partial")
            while not partial.exists() and run.poll() is None:
                pass
            run.send_signal(signal.SIGINT)
            _, error = run.communicate(timeout=20)
            self.assertEqual((run.returncode, error), (65, f"airworthy-import: {long}: interrupted\n"))
        self.assertFalse(partial.exists())
        self.assertFalse(log.exists())


def main():
    Import.program, config, data = sys.argv[1:4]
    Import.config = pathlib.Path(config)
    Import.data = pathlib.Path(os.environ.get("AIRWORTHY_DATA") or data)
    if not (Import.data / "alfa").is_dir():
        print(f"no recorded flights in {Import.data}: set AIRWORTHY_DATA")
        sys.exit(SKIPPED)
    unittest.main(argv=sys.argv[:1], verbosity=2)


if __name__ == "__main__":
    main()
