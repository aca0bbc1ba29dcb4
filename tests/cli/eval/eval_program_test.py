#!/usr/bin/python3
"""airworthy eval on simulated flights: what is found, who is named, what nobody judged, what is refused.

  eval_program_test.py AIRWORTHY-SIM AIRWORTHY-CALIBRATE AIRWORTHY-EVAL CONFIG-FOLDER
"""
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

EFFECTIVENESS = ("--detector", "effectiveness")
UNBALANCE = ("--detector", "unbalance")


def run(*command):
    return subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)


def of_vehicle(name):
    return "--set", f"vehicle={CONFIG}/vehicles/{name}.toml"


class Eval(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.temporary.name)
        cls.healthy = cls.simulated("healthy_manoeuvres", "--duration", "30")
        cls.frozen = cls.simulated("gyro_freeze", "--duration", "35")

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    @classmethod
    def simulated(cls, scenario, *options):
        log = cls.folder / f"{scenario}{''.join(options)}.lcm"
        done = run(SIM, "--vehicle", CONFIG / "vehicles/unbalance_medium.toml",
                   "--scenario", CONFIG / f"scenarios/{scenario}.toml", *options, "-o", log)
        assert done.returncode == 0, done.stderr
        return log

    def evaluate(self, detector, *arguments):
        name = detector[1] if detector else "response_multirotor"
        vehicle = of_vehicle("unbalance_medium") if detector else ()
        return run(EVAL, *detector, "--config", CONFIG / f"{name}.toml", *vehicle, *arguments)

    def result(self, *arguments, code=0):
        done = self.evaluate(*arguments, "--json")
        self.assertEqual(done.returncode, code, done.stderr)
        return json.loads(done.stdout)

    def flight(self, *arguments, code=0):
        flight, = self.result(*arguments, code=code)["flights"]
        return flight

    def test_a_rotor_blamed_for_a_frozen_gyro_is_a_false_alarm(self):
        result = self.result(EFFECTIVENESS, self.frozen)
        flight, = result["flights"]
        outcome = "false alarm" if flight["alarms"] else "silent"  # the detector may learn better
        self.assertEqual((flight["outcome"], flight["truth"]), (outcome, "imu gyro_freeze (not watched)"))
        self.assertEqual(result["totals"]["tp"], 0)

    def test_of_several_faults_the_watched_one_counts_and_is_named(self):
        log = self.simulated("demo")
        flight = self.flight(EFFECTIVENESS, log)
        self.assertEqual((flight["outcome"], flight["named"]), ("found", "right"))
        self.assertLess(flight["delay_s"], 0.5)
        watched = {fault["component"]: fault["watched"] for fault in flight["faults"]}
        self.assertEqual(watched, {"link autopilot": False, "rotor 2": False, "rotor 3": True})

    def test_a_fault_that_the_log_does_not_reach_is_said_and_not_missed(self):
        log = self.simulated("propeller_lost", "--duration", "20")
        flight = self.flight(EFFECTIVENESS, log)
        self.assertEqual((flight["outcome"], flight["truth"]), ("silent", "rotor 2 propeller_lost (never in the log)"))

    def test_what_nobody_judged_is_not_healthy(self):
        for detector in EFFECTIVENESS, UNBALANCE, ():
            with self.subTest(detector=detector):
                arguments = (self.healthy, "--vehicle", "medium")
                wrong = (*arguments, "--set", "input.imu_sensor_id=7")
                result = self.result(detector, *wrong, code=66)
                self.assertEqual(result["flights"][0]["outcome"], "not judged")
                self.assertEqual((result["totals"]["tn"], result["totals"]["not_judged"]), (0, 1))
                self.assertIsNone(result["totals"]["accuracy"])
                self.assertIsNone(result["totals"]["false_alarms_per_hour"])
                table = self.evaluate(detector, *wrong)
                self.assertRegex(table.stderr, "not judged: .*; the log has IMU of sensor 0, speeds of 4 rotors")
                self.assertIn("No flight is scored.", table.stdout)
                self.assertRegex(table.stdout, r"none +not judged 1\n")

                right = self.flight(detector, *arguments)
                self.assertEqual(right["outcome"], "silent")
                self.assertGreater(right["judged_s"], 5.0)
                self.assertLess(right["judged_s"], right["duration_s"])

    def test_rotors_of_another_number_are_named_as_the_reason(self):
        six = self.folder / "six.toml"
        six.write_text((CONFIG / "vehicles/unbalance_hexa.toml").read_text(encoding="utf-8"), encoding="utf-8")
        done = self.evaluate(EFFECTIVENESS, self.healthy, "--set", f"vehicle={six}", "--vehicle", "medium")
        self.assertEqual(done.returncode, 66)
        self.assertIn("speeds.wrong_rotor_count", done.stderr)

    def test_logs_of_another_vehicle_are_refused_whatever_the_detector(self):
        for detector in (), EFFECTIVENESS, UNBALANCE:
            done = self.evaluate(detector, self.healthy, *of_vehicle("octo"))
            self.assertEqual(done.returncode, 65)
            self.assertIn('of vehicle "medium", not of "octo" (--vehicle NAME says whose logs these are)', done.stderr)
            self.assertEqual(done.stdout, "", "nothing was evaluated")
        nested = self.evaluate((), self.healthy, self.frozen, "--nested", *of_vehicle("octo"))
        self.assertEqual((nested.returncode, nested.stdout), (65, ""))
        self.assertIn('of vehicle "medium", not of "octo"', nested.stderr)

    def test_a_log_given_twice_is_refused(self):
        done = self.evaluate(EFFECTIVENESS, self.healthy, self.folder / "." / ".." / self.folder.name / self.healthy.name)
        self.assertEqual((done.returncode, done.stdout), (64, ""))
        self.assertIn("given twice", done.stderr)

    def test_the_warm_up_is_said(self):
        self.assertIn("Alarms of the first 20 s", self.evaluate((), self.healthy, "--vehicle", "medium").stdout)
        self.assertNotIn("Alarms of the first", self.evaluate(EFFECTIVENESS, self.healthy).stdout)
        self.assertIn("first 20 s", run(EVAL, "--help").stdout)

    def test_a_calibration_is_taken_by_every_detector_of_its_own(self):
        calibration = self.folder / "learned's \"best\".toml"
        vehicle = of_vehicle("unbalance_medium")
        whole = self.simulated("healthy_manoeuvres")
        for detector in EFFECTIVENESS, UNBALANCE:
            done = run(CALIBRATE, detector[1], "--config", CONFIG / f"{detector[1]}.toml", *vehicle, whole, "-o", calibration)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(self.flight(detector, self.healthy, "--calibration", calibration)["outcome"], "silent")
        done = self.evaluate(EFFECTIVENESS, self.healthy, "--calibration", calibration)
        self.assertEqual(done.returncode, 78, "that of the unbalance")
        self.assertIn(str(calibration), done.stderr)

    def test_errors_have_one_prefix(self):
        done = self.evaluate(EFFECTIVENESS, self.healthy, "--nested")
        self.assertEqual((done.returncode, done.stderr), (64, "airworthy-eval: --nested is for --detector response\n"))


if __name__ == "__main__":
    SIM, CALIBRATE, EVAL, CONFIG = (pathlib.Path(argument) for argument in sys.argv[1:5])
    unittest.main(argv=sys.argv[:1], verbosity=2)
