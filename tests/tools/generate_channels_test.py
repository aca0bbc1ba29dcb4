#!/usr/bin/python3
"""Tests of tools/generate_channels.py: the committed page is its output, and each broken table is refused in words."""
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

PROJECT = pathlib.Path(__file__).resolve().parents[2]
TABLE = PROJECT / "lcmtypes/channels.toml"
GOOD = """
[[channel]]
name = "IMU"
type = "imu_t"
role = "input"
producer = "driver"
nominal_Hz = 500.0
staleness_ms = 1000
about = "rates"
"""

# what is wrong: how the good table is changed, and every line that must come out (T stands for the table's path)
BROKEN = {
    "a missing key": (('about = "rates"\n', ""), ["T: channel 1 (IMU): about: missing"]),
    "an unknown key": (("about", 'unit = "m"\nabout'), ["T: channel 1 (IMU): unit: unknown key"]),
    "a wrong type": (("500.0", "500"), ["T: channel 1 (IMU): nominal_Hz: must be float"]),
    "a name LCM would split": (('"IMU"', '"imu/raw"'), ["T: channel 1 (imu/raw): name: must be 1 to 40 of A-Z and _"]),
    "a role that does not exist": (('"input"', '"output"'),
                                   ["T: channel 1 (IMU): role: must be one of input, derived, truth"]),
    "a type without a file": (("imu_t", "inertia_t"), ["T: channel 1 (IMU): type: no file inertia_t.lcm beside the table"]),
    "a name given twice": ((GOOD, GOOD + GOOD), ["T: channel 2 (IMU): name: given twice"]),
    "no channel": ((GOOD, ""), ["T: no [[channel]] entry"]),
    "two faults at once": (('role = "input"\nproducer = "driver"\n', 'role = "input"\nproducer = 1\nspare = 2\nnominal = 1\n'), [
        "T: channel 1 (IMU): spare: unknown key", "T: channel 1 (IMU): nominal: unknown key",
        "T: channel 1 (IMU): producer: must be str"]),
}


def generate(*arguments):
    run = subprocess.run([PROJECT / "tools/generate_channels.py", *arguments], capture_output=True, text=True, check=False)
    return run.returncode, run.stdout, run.stderr


class GenerateChannels(unittest.TestCase):
    def test_the_committed_page_is_the_output(self):
        code, page, errors = generate("docs", TABLE)
        self.assertEqual((code, errors), (0, ""))
        self.assertEqual((PROJECT / "docs/channels.md").read_text(encoding="utf-8"), page,
                         "run tools/generate_channels.py docs lcmtypes/channels.toml > docs/channels.md")

    def test_every_fault_of_a_broken_table_is_named(self):
        for what, ((old, new), expected) in BROKEN.items():
            with self.subTest(what), tempfile.TemporaryDirectory() as folder:
                table = pathlib.Path(folder, "channels.toml")
                table.write_text(GOOD.replace(old, new), encoding="utf-8")
                pathlib.Path(folder, "imu_t.lcm").touch()
                code, page, errors = generate("header", table)
                self.assertEqual((code, page), (1, ""))
                self.assertEqual(errors.replace(str(table), "T").splitlines(), expected)

    def test_the_regular_expression_takes_one_role_of_one_vehicle(self):
        code, pattern, _ = generate("regex", TABLE, "input", "bee")
        self.assertEqual(code, 0)
        for channel, taken in {"bee/IMU": True, "bee/TICK": True, "bee/FAULT_EVENT": False, "wasp/IMU": False,
                               "bee/IMU2": False, "xbee/IMU": False, "bee/GROUND_TRUTH": False}.items():
            self.assertEqual(bool(re.search(pattern.strip(), channel)), taken, channel)

    def test_an_unknown_role_is_refused(self):
        self.assertEqual(generate("regex", TABLE, "output", "bee"),
                         (1, "", "role 'output' must be one of input, derived, truth\n"))

    def test_wrong_arguments_print_the_usage(self):
        code, _, errors = generate("nothing")
        self.assertEqual(code, 1)
        self.assertIn("generate_channels.py header CHANNELS.toml", errors)


if __name__ == "__main__":
    unittest.main(argv=sys.argv)
