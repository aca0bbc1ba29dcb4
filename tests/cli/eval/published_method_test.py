#!/usr/bin/python3
"""The published ARX method on recorded flights, imported and evaluated by the programs: it fails as docs/equations/arx.md says.

  published_method_test.py AIRWORTHY-IMPORT AIRWORTHY-EVAL CONFIG-FOLDER DATA-FOLDER

DATA-FOLDER may be overridden by AIRWORTHY_DATA; where neither exists nothing is tested.
"""
import collections
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

SKIPPED = 77
NOT_JUDGED = 66
FLIGHTS = ("carbonZ_2018-07-18-15-53-31_1_engine_failure", "carbonZ_2018-09-11-14-22-07_1_engine_failure",
           "carbonZ_2018-09-11-14-41-51_elevator_failure", "carbonZ_2018-09-11-17-27-13_2_both_ailerons_failure",
           "carbonZ_2018-10-05-15-52-12_1_no_failure", "carbonZ_2018-10-18-11-04-08_1_engine_failure_with_emr_traj")


class PublishedMethod(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        subprocess.run([IMPORT, "alfa", *(DATA / "alfa" / flight for flight in FLIGHTS), "-o", cls.folder.name], check=True,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        cls.logs = sorted(pathlib.Path(cls.folder.name).glob("*.lcm"))

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def evaluate(self, config, expected_code=0, **settings):
        command = [EVAL, "--json", "--vehicle", "alfa", "--config", CONFIG / config]
        for key, value in settings.items():
            for channel in (0, 1):
                command += ["--set", f"channel[{channel}].{key}={json.dumps(value)}"]
        done = subprocess.run([*command, *self.logs], check=False, capture_output=True)
        self.assertEqual(done.returncode, expected_code, done.stderr)
        return done.stdout

    def outcomes(self, config, expected_code=0, **settings):
        rows = json.loads(self.evaluate(config, expected_code, **settings))["flights"]
        self.assertEqual(len(rows), len(FLIGHTS))
        return collections.Counter(row["outcome"] for row in rows)

    def test_to_the_letter_it_alarms_before_any_fault(self):
        outcomes = self.outcomes("response_arx.toml")
        print("letter:", dict(outcomes), file=sys.stderr)
        self.assertEqual(outcomes["early"] + outcomes["false alarm"], len(FLIGHTS))

    def test_on_fresh_samples_it_never_begins_to_judge(self):
        outcomes = self.outcomes("response_arx.toml", NOT_JUDGED, samples="fresh")
        self.assertEqual(outcomes["not judged"], len(FLIGHTS))

    def test_the_shipped_method_is_better_on_the_same_flights(self):
        outcomes = self.outcomes("response.toml")
        print("shipped:", dict(outcomes), file=sys.stderr)
        self.assertGreaterEqual(outcomes["found"] + outcomes["silent"], len(FLIGHTS) - 1)

    def test_twice_the_same_bytes(self):
        self.assertEqual(self.evaluate("response_arx.toml"), self.evaluate("response_arx.toml"))


if __name__ == "__main__":
    IMPORT, EVAL, CONFIG = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
    DATA = pathlib.Path(os.environ.get("AIRWORTHY_DATA") or sys.argv[4])
    if not (DATA / "alfa").is_dir():
        print(f"SKIPPED: no recorded flights in {DATA / 'alfa'}")
        sys.exit(SKIPPED)
    unittest.main(argv=sys.argv[:1])
