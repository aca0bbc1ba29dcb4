#!/usr/bin/python3
"""Compares the fingerprints of the messages with lcmtypes/fingerprints.txt: a released type must not change.

  fingerprints_test.py PROGRAM            PROGRAM prints "type fingerprint" lines
"""
import pathlib
import subprocess
import sys
import unittest

MESSAGES = pathlib.Path(__file__).resolve().parents[2] / "lcmtypes"
ADVICE = """
A receiver and a recording know a message by its fingerprint: changing a type that was released makes every old
recording unreadable and every other program of the vehicle deaf. Leave the type as it was and add a new one
(another file, another channel in channels.toml, both published while old readers exist).
Only for a type that no release contains: copy the line that build/dev/tests/fingerprints prints into lcmtypes/fingerprints.txt."""


def table(text):
    lines = [line.split("#")[0].split() for line in text.splitlines()]
    return {line[0]: line[1] for line in lines if line}


class Fingerprints(unittest.TestCase):
    program = ""

    def setUp(self):
        self.built = table(subprocess.run([self.program], capture_output=True, text=True, check=True).stdout)

    def test_no_released_type_changed(self):
        recorded = table((MESSAGES / "fingerprints.txt").read_text(encoding="utf-8"))
        differences = [f"{name}: recorded {recorded.get(name, 'nothing')}, built {self.built.get(name, 'nothing')}"
                       for name in sorted({*recorded, *self.built}) if recorded.get(name) != self.built.get(name)]
        self.assertEqual(differences, [], ADVICE)

    def test_every_message_file_is_built(self):
        self.assertEqual(sorted(self.built), sorted(file.stem for file in MESSAGES.glob("*.lcm")),
                         "lcmtypes/CMakeLists.txt lists the types by name")


if __name__ == "__main__":
    Fingerprints.program = sys.argv.pop(1)
    unittest.main(argv=sys.argv)
