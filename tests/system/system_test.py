"""What the system tests share: where things are, the real flights, a rig per test."""
import csv
import os
import pathlib
import sys
import unittest

PROJECT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(PROJECT / "tools"))
import flight_rig  # noqa: E402  (found through the line above)

BINARIES = pathlib.Path(os.environ.get("AIRWORTHY_BINARIES", PROJECT / "build/dev/bin"))
DATA = pathlib.Path(os.environ.get("AIRWORTHY_DATA", PROJECT.parent / "shared/data"))
SKIPPED = 77


def truth():
    """Onset of the fault in µs of UTC by flight; None for a healthy one."""
    with open(DATA / "alfa/index.csv", encoding="utf-8") as file:
        return {row["sequence"]: int(row["fault_onset_ns"]) // 1000 if row["fault_onset_ns"] else None
                for row in csv.DictReader(file)}


def flights(*words):
    """Recorded flights whose name contains one of the words, by name."""
    found = sorted((DATA / "alfa_mavlink").glob("*.tlog.xz"))
    return {path.name.removesuffix(".tlog.xz"): path for path in found if any(word in path.name for word in words)}


def main():
    """Runs the tests of a file. Without flight data the whole file is skipped, and says so."""
    if not (DATA / "alfa_mavlink").is_dir():
        print(f"SKIPPED: no flight data at {DATA} (set AIRWORTHY_DATA)", file=sys.stderr)
        sys.exit(SKIPPED)
    run_tests()


def run_tests():
    """Runs the tests of a file; where one was skipped the whole file counts as skipped, and says why."""
    result = unittest.main(module="__main__", verbosity=2, exit=False).result
    for _, reason in result.skipped:
        print(f"SKIPPED: {reason}", file=sys.stderr)
    sys.exit(1 if not result.wasSuccessful() else SKIPPED if result.skipped else 0)


class SystemTest(unittest.TestCase):
    def assert_alive(self, rig):
        self.assertEqual(rig.dead(), {}, "a process ended by itself")

    def rig(self, speed, **options):
        rig = flight_rig.Rig(BINARIES, speed, **options)
        self.addCleanup(rig.__exit__)
        return rig

    def feed(self, rig):
        feed = flight_rig.Feed(rig.endpoint)
        self.addCleanup(feed.close)
        return feed

    def start_system(self, rig, feed, driver_overrides=()):
        rig.start_gateway()
        rig.start_response()
        rig.start_driver(driver_overrides)
        up = feed.wait_for(lambda kind, document: kind == "health" and alive(document) >= {
            "airworthy-mavlink", "airworthy-response"}, 20)
        self.assertIsNotNone(up, f"the system did not come up: {rig.dead()}")


def alive(health):
    """Processes that give a life sign; a driver without its device is degraded, but alive."""
    return {process["process"] for process in health["processes"] if process["status"] in ("running", "degraded")}
