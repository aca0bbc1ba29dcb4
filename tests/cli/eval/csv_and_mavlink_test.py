#!/usr/bin/python3
"""The same flight from CSV topics and from raw MAVLink through the driver's translation: the same verdict at the same time.

  csv_and_mavlink_test.py AIRWORTHY-IMPORT AIRWORTHY-CALIBRATE AIRWORTHY-EVAL CONFIG-FOLDER DATA-FOLDER

DATA-FOLDER may be overridden by AIRWORTHY_DATA; where neither exists nothing is tested.
"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

SKIPPED = 77
FLIGHT = r"(\d{4}-\d\d-\d\d-\d\d-\d\d-\d\d)"
LARGEST_DIFFERENCE_S = 0.2


def run(*command):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


class CsvAndMavlink(unittest.TestCase):
    def test_the_same_verdict_at_the_same_time(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            packets = sorted((DATA / "alfa_mavlink").glob("*.tlog.xz"))
            flights = [path.name.removesuffix(".tlog.xz") for path in packets]
            run(IMPORT, "alfa", *(DATA / "alfa" / flight for flight in flights), "-o", folder / "csv")
            run(IMPORT, "tlog", *packets, "--vehicle", "alfa", "--truth", DATA / "alfa/index.csv", "-o", folder / "mavlink")
            csv, mavlink = sorted((folder / "csv").glob("*.lcm")), sorted((folder / "mavlink").glob("*.lcm"))
            run(CALIBRATE, "--config", CONFIG / "response.toml", "--vehicle", "alfa", "--flight-name", FLIGHT, "-o",
                folder / "alfa.toml", *csv)
            rows = {source: {row["flight"]: row for row in json.loads(run(
                        EVAL, "--json", "--config", CONFIG / "response.toml", "--vehicle", "alfa",
                        "--calibration", folder / "alfa.toml", *logs))["flights"]}
                    for source, logs in (("csv", csv), ("mavlink", mavlink))}
        self.assertEqual(len(rows["csv"]), len(flights))
        differences = []
        for flight in flights:
            one, other = rows["csv"][flight], rows["mavlink"][flight]
            self.assertEqual(one["outcome"], other["outcome"], flight)
            if not one["alarms"]:
                continue
            first, second = one["alarms"][0], other["alarms"][0]
            self.assertEqual(first["component"], second["component"], flight)
            differences.append(abs(first["time_us"] - second["time_us"]) / 1e6)
            self.assertLessEqual(differences[-1], LARGEST_DIFFERENCE_S, flight)
        print(f"{len(flights)} flights, {len(differences)} with an alarm: detection times differ by at most "
              f"{max(differences):.3f} s, in the mean {sum(differences) / len(differences):.3f} s", file=sys.stderr)
        self.assertGreater(len(differences), len(flights) // 2)


if __name__ == "__main__":
    IMPORT, CALIBRATE, EVAL, CONFIG = (pathlib.Path(argument) for argument in sys.argv[1:5])
    DATA = pathlib.Path(os.environ.get("AIRWORTHY_DATA") or sys.argv[5])
    if not (DATA / "alfa").is_dir() or not (DATA / "alfa_mavlink").is_dir():
        print(f"SKIPPED: no recorded flights in {DATA}/alfa and {DATA}/alfa_mavlink")
        sys.exit(SKIPPED)
    unittest.main(argv=sys.argv[:1], verbosity=2)
