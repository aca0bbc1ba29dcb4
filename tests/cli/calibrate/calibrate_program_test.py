#!/usr/bin/python3
"""airworthy calibrate and warm evaluation on recorded flights: what is learned, what is refused, what it finds.

  calibrate_program_test.py AIRWORTHY-IMPORT AIRWORTHY-CALIBRATE AIRWORTHY-EVAL CONFIG-FOLDER DATA-FOLDER

DATA-FOLDER may be overridden by AIRWORTHY_DATA; where neither exists nothing is tested.
"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import tomllib
import unittest

SKIPPED = 77
TAUGHT_BY = ("carbonZ_2018-10-05-15-55-10_engine_failure_with_emr_traj", "carbonZ_2018-09-11-14-41-51_elevator_failure",
             "carbonZ_2018-09-11-14-52-54_left_aileron__right_aileron__failure",
             "carbonZ_2018-09-11-17-27-13_2_both_ailerons_failure", "carbonZ_2018-10-05-14-37-22_2_right_aileron_failure",
             "carbonZ_2018-10-05-15-52-12_1_no_failure", "carbonZ_2018-10-18-11-04-08_2_engine_failure_with_emr_traj")
TRIED_ON = ("carbonZ_2018-09-11-14-22-07_2_engine_failure", "carbonZ_2018-10-18-11-03-57_engine_failure_with_emr_traj",
            "carbonZ_2018-09-11-15-06-34_1_rudder_right_failure", "carbonZ_2018-10-18-11-08-24_no_failure")
FLIGHT = r"(\d{4}-\d\d-\d\d-\d\d-\d\d-\d\d)"


def run(*command):
    return subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)


class Calibrate(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.temporary.name)
        done = run(IMPORT, "alfa", *(DATA / "alfa" / flight for flight in TAUGHT_BY + TRIED_ON), "-o", cls.folder)
        assert done.returncode == 0, done.stderr

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def logs(self, names):
        return [self.folder / f"{name}.lcm" for name in names]

    def calibrate(self, output, *options, flights=TAUGHT_BY):
        return run(CALIBRATE, "--config", CONFIG / "response.toml", "--vehicle", "alfa", "--flight-name", FLIGHT,
                   "-o", output, *options, *self.logs(flights))

    def evaluate(self, *options, flights):
        done = run(EVAL, "--json", "--config", CONFIG / "response.toml", "--vehicle", "alfa", *options, *self.logs(flights))
        self.assertEqual(done.returncode, 0, done.stderr)
        return {row["flight"]: row for row in json.loads(done.stdout)["flights"]}

    def test_a_warm_start_finds_at_once_what_a_cold_one_finds_late(self):
        calibration = self.folder / "warm.toml"
        done = self.calibrate(calibration)
        self.assertEqual(done.returncode, 0, done.stderr)
        print(done.stdout, file=sys.stderr)
        rows = self.evaluate("--calibration", calibration, flights=TRIED_ON)
        for name, row in rows.items():
            print(name, row["outcome"], row["delay_s"], file=sys.stderr)
            self.assertEqual(row["outcome"], "silent" if "no_failure" in name else "found", name)
            if row["delay_s"] is not None:
                self.assertLess(row["delay_s"], 2.0, name)
        cold = self.evaluate(flights=TRIED_ON[:1])
        self.assertGreater(cold[TRIED_ON[0]]["delay_s"], 5.0)

    def test_the_same_flights_teach_the_same_bytes(self):
        first, second = self.folder / "first.toml", self.folder / "second.toml"
        self.assertEqual(self.calibrate(first, "--jobs", "1").returncode, 0)
        self.assertEqual(self.calibrate(second, "--jobs", "2").returncode, 0)
        self.assertEqual(first.read_bytes(), second.read_bytes())

    def test_nested_is_warm_with_the_flight_left_out(self):
        calibration = self.folder / "others.toml"
        left_out, *others = TRIED_ON + TAUGHT_BY
        self.assertEqual(self.calibrate(calibration, flights=others).returncode, 0)
        warm = self.evaluate("--calibration", calibration, flights=[left_out])[left_out]
        nested = self.evaluate("--nested", "--flight-name", FLIGHT, flights=TRIED_ON + TAUGHT_BY)[left_out]
        self.assertEqual(nested["alarms"], warm["alarms"])
        self.assertEqual(nested["outcome"], "found")

    def test_logs_of_another_vehicle_are_refused(self):
        output = self.folder / "foreign.toml"
        done = run(CALIBRATE, "--config", CONFIG / "response.toml", "-o", output, *self.logs(TAUGHT_BY))
        self.assertEqual(done.returncode, 65)
        self.assertIn(f'{self.logs(TAUGHT_BY)[0]}: of vehicle "alfa", not of "plane1"', done.stderr)
        self.assertEqual(len(done.stderr.strip().splitlines()), len(TAUGHT_BY))
        self.assertFalse(output.exists())

    def test_a_file_that_is_no_log_is_refused(self):
        (self.folder / "picture.lcm").write_bytes(b"\x89PNG" * 100)
        output = self.folder / "refused.toml"
        done = self.calibrate(output, self.folder / "picture.lcm")
        self.assertEqual(done.returncode, 65)
        self.assertIn("picture.lcm", done.stderr)
        self.assertFalse(output.exists())

    def test_a_calibration_of_another_vehicle_is_refused_by_eval(self):
        calibration = self.folder / "renamed.toml"
        self.assertEqual(self.calibrate(calibration).returncode, 0)
        calibration.write_text(calibration.read_text().replace('vehicle = "alfa"', 'vehicle = "other"'))
        done = run(EVAL, "--config", CONFIG / "response.toml", "--vehicle", "alfa", "--calibration", calibration,
                   *self.logs(TRIED_ON[:1]))
        self.assertEqual(done.returncode, 65)
        self.assertIn('of vehicle "alfa", but the calibration is of "other"', done.stderr)

    def test_suggested_pairs_begin_with_the_attitude_and_its_set_point(self):
        done = run(CALIBRATE, "--config", CONFIG / "response.toml", "--suggest-pairs", "--json", *self.logs(TAUGHT_BY))
        self.assertEqual(done.returncode, 0, done.stderr)
        pairs = [(pair["inputs"][0]["signal"], pair["response"], pair["score"]) for pair in json.loads(done.stdout)["pairs"]]
        self.assertEqual(pairs[0][:2], ("roll_setpoint_rad", "roll_rad"))
        self.assertIn(("roll_error_rad", "roll_rate_rad_s"), [pair[:2] for pair in pairs])
        self.assertEqual([score for *_, score in pairs], sorted((score for *_, score in pairs), reverse=True))

    def test_neither_output_nor_suggestion_is_a_usage_error(self):
        done = run(CALIBRATE, "--config", CONFIG / "response.toml", *self.logs(TAUGHT_BY[:1]))
        self.assertEqual(done.returncode, 64)
        self.assertIn("--output FILE or --suggest-pairs is needed", done.stderr)

    def test_an_output_that_cannot_be_written_is_an_error(self):
        done = self.calibrate(self.folder / "missing" / "out.toml")
        self.assertEqual(done.returncode, 73)
        self.assertIn("out.toml: cannot be written: No such file or directory", done.stderr)


class Effectiveness(unittest.TestCase):
    """Learned from the hover of a recorded Bebop 2 until it ejects a propeller: pitch alone is excited."""

    def setUp(self):
        flight = DATA / "bebop2_prop_eject" / "flight01_11-43-10.csv.xz"
        if not flight.exists():
            self.skipTest(f"no recorded flight {flight}")
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)
        self.log = self.folder / "bebop2.lcm"
        done = run(IMPORT, "table", flight, "--map", CONFIG / "import" / "bebop2_prop_eject.toml", "-o", self.log)
        self.assertEqual(done.returncode, 0, done.stderr)

    def calibrate(self, *options):
        return run(CALIBRATE, "effectiveness", self.log, "--config", CONFIG / "effectiveness.toml",
                   "--set", f"vehicle={CONFIG}/vehicles/bebop2.toml", "--set", "input.telemetry_latency_ms=0",
                   "-o", self.folder / "learned.toml", *options)

    def test_axes_that_were_not_excited_are_refused_by_name(self):
        done = self.calibrate()
        self.assertEqual(done.returncode, 65)
        self.assertIn("roll axis not excited", done.stderr)
        self.assertIn("vertical axis not excited", done.stderr)
        self.assertNotIn("pitch axis", done.stderr)
        self.assertFalse((self.folder / "learned.toml").exists())

    def test_keep_unexcited_keeps_them_as_described_and_says_so(self):
        done = self.calibrate("--keep-unexcited")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stdout, "roll +gain of the vehicle file: not excited")
        learned = tomllib.loads((self.folder / "learned.toml").read_text(encoding="utf-8"))
        self.assertEqual([learned[axis]["excited"] for axis in ("roll", "pitch", "vertical")], [False, True, False])
        self.assertEqual((learned["roll"]["gain"], learned["vertical"]["gain"]), (1.0, 1.0))
        self.assertNotEqual(learned["pitch"]["gain"], 1.0)


if __name__ == "__main__":
    IMPORT, CALIBRATE, EVAL, CONFIG = (pathlib.Path(argument) for argument in sys.argv[1:5])
    DATA = pathlib.Path(os.environ.get("AIRWORTHY_DATA") or sys.argv[5])
    if not (DATA / "alfa").is_dir():
        print(f"SKIPPED: no recorded flights in {DATA}/alfa")
        sys.exit(SKIPPED)
    unittest.main(argv=sys.argv[:1], verbosity=2)
