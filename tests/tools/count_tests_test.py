#!/usr/bin/python3
"""Tests of tools/count_tests.py on a results file with one test of each outcome."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

PROJECT = pathlib.Path(__file__).resolve().parents[2]
RESULTS = """<testsuite name="s">
<testcase name="good" status="run"><system-out>fine</system-out></testcase>
<testcase name="partly" status="run"><system-out>[ RUN      ] Flight.Bebop
flight_test.cpp:12: Skipped
no recorded flight in ../shared/data

[  SKIPPED ] Flight.Bebop (0 ms)
[  SKIPPED ] 1 test, listed below:
[  SKIPPED ] Flight.Bebop
</system-out></testcase>
<testcase name="bad" status="fail"><failure message=""/><system-out>broken</system-out></testcase>
<testcase name="whole" status="notrun"><skipped message="SKIP_RETURN_CODE=77"/><system-out>no namespaces
</system-out></testcase>
<testcase name="absent" status="notrun"><skipped message="Unable to find executable"/></testcase>
<testcase name="off" status="disabled"/>
</testsuite>"""


class CountTests(unittest.TestCase):
    def test_each_outcome_is_counted_once(self):
        with tempfile.NamedTemporaryFile("w", suffix=".xml") as file:
            file.write(RESULTS)
            file.flush()
            run = subprocess.run([PROJECT / "tools/count_tests.py", file.name], capture_output=True, text=True, check=True)
        self.assertEqual(run.stdout.splitlines(), [
            "2 2 3", "partly: Flight.Bebop: no recorded flight in ../shared/data", "whole: no namespaces", "off: disabled"])


if __name__ == "__main__":
    unittest.main(argv=sys.argv)
