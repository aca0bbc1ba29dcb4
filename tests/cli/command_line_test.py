#!/usr/bin/python3
"""Gives the commands wrong arguments: each says its name, the option and what would be right, and ends with 64.

  command_line_test.py FOLDER-OF-PROGRAMS CONFIG-FOLDER
"""
import pathlib
import subprocess
import sys
import tempfile
import unittest

BINARIES, CONFIG = map(pathlib.Path, sys.argv[1:3])
USAGE, DATA, CANNOT_CREATE, CONFIG_ERROR = 64, 65, 73, 78


class CommandLine(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def run_it(self, name, *arguments, code=USAGE):
        """What it prints, the errors without the program's name in front of each line."""
        program = f"airworthy-{name}"
        done = subprocess.run([BINARIES / program, *map(str, arguments)], capture_output=True, text=True, timeout=20)
        self.assertEqual(done.returncode, code, (arguments, done.stderr))
        lines = done.stderr.splitlines()
        for line in lines:
            self.assertTrue(line.startswith(f"{program}: "), line)
        return done.stdout if code == 0 else "\n".join(line.removeprefix(f"{program}: ") for line in lines)

    def first_line(self, *arguments, **options):
        return self.run_it(*arguments, **options).splitlines()[0]

    def import_table(self, *options, code, output=None):
        table = self.folder / "t.csv"
        table.write_text("t,x\n1,2\n3,4\n")
        chart = self.folder / "map.toml"
        if not chart.exists():
            chart.write_text('vehicle = "v"\n[[table]]\ntime = {column = "t", unit = "s"}\n[[table.message]]\nchannel = "IMU"\n'
                             'fields = [{field = "accel_m_s2[0]", column = "x"}]\n')
        return self.run_it("import", "table", table, "--map", chart, "-o", output or self.folder / "x.lcm", *options, code=code)

    def test_moments_of_an_import_are_numbers(self):
        for option in ("--from", "--until"):
            for text in ("nan", "inf", "-inf", "1e300", "9.3e12", "-1", "soon"):
                said = self.import_table(option, text, code=USAGE)
                self.assertEqual(said.splitlines()[0], f"{option}: must lie in [0, 9000000000000], is {text}")
        self.assertIn("--until: 1 is before --from (2)", self.import_table("--from", "2", "--until", "1", code=USAGE))
        self.import_table("--from", "0", "--until", "9e12", code=0)

    def test_a_wrong_import_says_whose_fault_it_is(self):
        (self.folder / "map.toml").write_text('vehicle = "v"\nspeed = 1\n')
        self.assertIn("speed: unknown key", self.import_table(code=CONFIG_ERROR))
        (self.folder / "map.toml").unlink()
        said = self.import_table(output=self.folder / "none" / "x.lcm", code=CANNOT_CREATE)
        self.assertIn("No such file or directory", said)
        self.assertIn("exists and is not a regular file", self.import_table(output=self.folder, code=CANNOT_CREATE))
        bad = self.folder / "mavlink.toml"
        bad.write_text("")
        said = self.run_it("import", "tlog", "x.tlog", "--config", bad, "-o", self.folder / "logs", code=CONFIG_ERROR)
        self.assertIn("link: missing mandatory key", said)
        blocked = self.folder / "file"
        blocked.write_text("")
        self.run_it("import", "tlog", "x.tlog", "-o", blocked / "logs", code=CANNOT_CREATE)
        self.run_it("import", "tlog", "x.tlog", "-o", self.folder / "logs", code=DATA)
        self.assertFalse((self.folder / "logs").exists())

    def test_what_can_be_imported_is_named(self):
        self.assertEqual(self.first_line("import", "bogus"), '"bogus" cannot be imported; there are alfa, tlog and table')
        self.assertEqual(self.first_line("import"), "what to import is missing: alfa, tlog or table")

    def test_watch_waits_for_a_number_of_seconds(self):
        for text in ("nan", "inf", "0", "-1", "1e300", "long"):
            self.assertEqual(self.first_line("watch", "--timeout", text), f"--timeout: must lie in (0, 1000000000], is {text}")
        for text in ("0", "-1", "1.5", "9223372036854775808"):
            self.assertEqual(self.first_line("watch", "--count", text),
                             f"--count: must be a whole number in [1, 9223372036854775807], is {text}")

    def test_calibrate_knows_what_it_calibrates(self):
        said = self.first_line("calibrate", "bogus", "x.lcm", "--config", CONFIG / "response.toml", "-o", self.folder / "x")
        self.assertEqual(said, '"bogus" is neither response, unbalance or effectiveness nor a log')
        for what in ("unbalance", "effectiveness"):
            self.assertIn(f"airworthy calibrate {what} ", self.run_it("calibrate", "--help", code=0))
        for what in ((), ("response",), ("unbalance",), ("effectiveness",)):
            self.assertEqual(self.first_line("calibrate", *what, "x.lcm", "--jobs", "0", "--config", "c", "-o", "o"),
                             "--jobs: must be a whole number in [1, 256], is 0")

    def test_eval_takes_numbers_that_mean_something(self):
        given = ("eval", "x.lcm", "--config", CONFIG / "response.toml", "--nested")
        for text in ("nan", "inf", "0", "11", "few"):
            self.assertEqual(self.first_line(*given, "--false-alarms-per-hour", text),
                             f"--false-alarms-per-hour: must lie in [1e-06, 10], is {text}")
        for text in ("0", "257", "07", "1.5"):
            self.assertEqual(self.first_line(*given, "--jobs", text), f"--jobs: must be a whole number in [1, 256], is {text}")

    def test_calibrate_replaces_nothing_but_a_file(self):
        target = self.folder / "target"
        target.write_text("old")
        link = self.folder / "link"
        link.symlink_to(target)
        for what, config in (("response", "response"), ("unbalance", "unbalance"), ("effectiveness", "effectiveness")):
            said = self.run_it("calibrate", what, "x.lcm", "--config", CONFIG / f"{config}.toml", "-o", link, code=CANNOT_CREATE)
            self.assertEqual(said, f"{link}: exists and is not a regular file")
        self.assertTrue(link.is_symlink())

    def test_every_command_tells_its_version(self):
        for name in ("sim", "calibrate", "import", "watch", "doctor", "eval"):
            self.assertRegex(self.run_it(name, "--version", code=0), r"\d+\.\d+\.\d+")
        for what in ("unbalance", "effectiveness", "response"):
            self.assertRegex(self.run_it("calibrate", what, "--version", code=0), r"\d+\.\d+\.\d+")

    def test_an_unknown_option_is_told_with_the_name_of_the_program(self):
        for name in ("watch", "doctor", "eval"):
            self.assertEqual(self.first_line(name, *["x.lcm", "--config", "c"] * (name == "eval"), "--colour"), "The following argument was not expected: --colour")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
