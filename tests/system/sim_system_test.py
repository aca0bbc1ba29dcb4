#!/usr/bin/python3
"""Runs airworthy-sim as users do, wrongly: every mistake must be named, with a code of sysexits.h, and leave no log.

  sim_system_test.py AIRWORTHY-SIM CONFIG-FOLDER
"""
import os
import pathlib
import resource
import signal
import subprocess
import sys
import tempfile
import time
import unittest

SIM, CONFIG = sys.argv[1], pathlib.Path(sys.argv[2])
USAGE, CONFIG_ERROR, UNAVAILABLE, CANNOT_CREATE, STOPPED = 64, 78, 69, 73, 75
HOVER = CONFIG / "scenarios/healthy_hover.toml"


class Sim(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.log = self.folder / "flight.lcm"

    def command(self, *options, scenario=HOVER, vehicle=CONFIG / "vehicles/bebop2.toml"):
        return [SIM, "--vehicle", str(vehicle), "--scenario", str(scenario), *map(str, options)]

    def sim(self, *options, code, says, **files):
        done = subprocess.run(self.command(*options, **files), capture_output=True, text=True, timeout=60)
        self.assertEqual(done.returncode, code, done.stderr)
        self.assertIn(says, done.stderr + done.stdout)
        return done

    def test_a_flight_is_written_and_counted(self):
        self.sim("--duration", 2, "-o", self.log, code=0, says="flight.lcm: 2.0 s")
        self.assertEqual([path.name for path in self.folder.iterdir()], ["flight.lcm"])

    def test_a_wrong_file_is_named_with_line_and_key(self):
        scenario = self.folder / "s.toml"
        scenario.write_text('[[segment]]\nmanoeuvre = "ground"\nduration_s = 1\n[[fault]]\nkind = "dead_esc"\n'
                            'rotor = 9\nonset_s = 1\n')
        self.sim("-o", self.log, scenario=scenario, code=CONFIG_ERROR,
                 says=f"airworthy-sim: {scenario}:6:1: fault[0].rotor: must lie in [1, 4], is 9")
        self.sim("-o", self.log, vehicle=self.folder / "none.toml", code=CONFIG_ERROR,
                 says="none.toml: cannot be opened: No such file or directory")
        self.sim("-o", self.log, vehicle=CONFIG / "vehicle.toml", code=CONFIG_ERROR, says="has no table [multirotor]")
        self.sim("-o", self.log, "--set", "segment[0].duration_s=-1", code=CONFIG_ERROR,
                 says="--set segment[0].duration_s: must lie in [0.1, 1000000], is -1")
        self.assertFalse(self.log.exists())

    def test_errors_of_both_files_are_told(self):
        scenario = self.folder / "s.toml"
        scenario.write_text('[[segment]]\nmanoeuvre = "swim"\nduration_s = 1\n')
        vehicle = self.folder / "v.toml"
        vehicle.write_text('name = "a b"\nkind = "multirotor"\n')
        done = self.sim("-o", self.log, scenario=scenario, vehicle=vehicle, code=CONFIG_ERROR, says=f"{vehicle}:1:1: name: must")
        self.assertIn(f"airworthy-sim: {scenario}:2:1: segment[0].manoeuvre: must be one of", done.stderr)

    def test_a_wrong_command_line_is_refused(self):
        for option, value in (("--duration", "0"), ("--duration", "-3"), ("--duration", "nan"), ("--duration", "1e9"),
                              ("--seed", "-1"), ("--seed", "x"), ("--seed", "18446744073709551616"),
                              ("--seed", "99999999999999999999999"), ("--vehicle-seed", "1e3"), ("--level", "easy"),
                              ("--level", "2"), ("--imu-average", "0.3"), ("--speed", "nan")):
            self.sim(option, value, "--live" if option == "--speed" else "-o", self.log, code=USAGE,
                     says=f"airworthy-sim: {option}: must ")
        self.sim(code=USAGE, says="airworthy-sim: --output LOG or --live LINK is needed")
        self.sim("-o", self.log, "--live", self.folder / "fc", code=USAGE, says="excludes")
        self.assertFalse(self.log.exists())

    def test_a_log_that_cannot_be_written_is_said_so(self):
        self.sim("-o", "/nonexistent/x.lcm", code=CANNOT_CREATE, says="/nonexistent/x.lcm.partial: No such file")
        self.sim("-o", self.folder, code=CANNOT_CREATE, says="exists and is not a regular file")
        fifo = self.folder / "fifo"
        os.mkfifo(fifo)
        self.sim("-o", fifo, code=CANNOT_CREATE, says="exists and is not a regular file")
        self.assertTrue(fifo.is_fifo())
        self.sim("--live", HOVER, code=UNAVAILABLE, says="exists and is not a symbolic link")

    def test_a_full_disk_ends_it_early_and_leaves_nothing(self):
        def limit():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))
        done = subprocess.run(self.command("--duration", 100_000, "-o", self.log), capture_output=True, text=True,
                              timeout=60, preexec_fn=limit)
        self.assertEqual(done.returncode, CANNOT_CREATE)
        self.assertTrue(done.stderr.endswith(f"airworthy-sim: {self.log}: File too large\n"), done.stderr)
        self.assertLessEqual(done.stderr.count("\n"), 4)
        self.assertEqual(list(self.folder.iterdir()), [])

    def test_a_stopped_flight_leaves_no_log_and_no_line(self):
        for options, code, made in ((("--duration", 100_000, "-o", self.log), STOPPED, "flight.lcm.partial"),
                                    (("--live", self.folder / "fc"), 0, "fc")):
            running = subprocess.Popen(self.command(*options), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            deadline = time.monotonic() + 30
            while not os.path.lexists(self.folder / made) and time.monotonic() < deadline:
                time.sleep(0.01)
            running.send_signal(signal.SIGINT)
            _, errors = running.communicate(timeout=30)
            self.assertEqual(running.returncode, code, errors)
            self.assertEqual(list(self.folder.iterdir()), [])

    def test_a_fault_after_the_end_is_warned_of(self):
        self.sim("--duration", 2, "-o", self.log, scenario=CONFIG / "scenarios/dead_esc.toml", code=0,
                 says="warning: dead_esc of rotor")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
