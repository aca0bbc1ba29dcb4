#!/usr/bin/python3
"""The shipped files and the commands of the pages form one system each: all processes of a set are of one vehicle.

  shipped_sets_test.py PROJECT FOLDER-OF-PROGRAMS
"""
import pathlib
import re
import shlex
import subprocess
import sys
import tomllib
import unittest

PROJECT, BINARIES = map(pathlib.Path, sys.argv[1:3])
CONFIG = PROJECT / "config"


def read(path):
    return tomllib.loads(path.read_text(encoding="utf-8"))


def code_blocks(page):
    return re.findall(r"```sh\n(.*?)```", (PROJECT / page).read_text(encoding="utf-8"), re.DOTALL)


def commands(block):
    """Words of each command, comments and a final & left out."""
    return [shlex.split(line, comments=True) for line in block.replace("\\\n", " ").replace(" &", "").splitlines()]


def after(command, option):
    return next((value for name, value in zip(command, command[1:]) if name == option), None)


def vehicle_file(path):
    return (path.parent / read(path)["vehicle"]).resolve()


class ShippedSets(unittest.TestCase):
    def systems(self):
        """Blocks of the pages in which a driver is started: (page, programs with their files, vehicles named)."""
        for page in ("README.md", "docs/simulator.md"):
            for block in code_blocks(page):
                started = {command[0]: PROJECT / after(command, "--config") for command in commands(block)
                           if command and command[0].startswith("airworthy-")}
                if "airworthy-mavlink" not in started:
                    continue
                vehicles = {vehicle_file(path) for path in started.values()}
                vehicles |= {(PROJECT / after(command, "--vehicle")).resolve() for command in commands(block)
                             if command[:2] == ["airworthy", "sim"] and "--live" in command}
                yield page, started, vehicles

    def test_a_block_of_a_page_starts_one_vehicle(self):
        found = list(self.systems())
        self.assertEqual(len(found), 3)
        for page, _, vehicles in found:
            self.assertEqual(len(vehicles), 1, (page, vehicles))

    def test_a_gateway_expects_what_its_block_starts(self):
        for page, started, _ in self.systems():
            if gateway := started.get("airworthy-gateway"):
                health = read(gateway)["health"]
                self.assertEqual(set(health["expected_processes"]) | {"airworthy-gateway"}, set(started), page)
                self.assertEqual({"airworthy-mavlink", *health["source"][0]["feeds"]}, set(health["expected_processes"]))

    def test_every_shipped_file_is_of_one_of_two_vehicles_and_valid(self):
        programs = {"response_arx": "response", "response_elevon": "response", "response_lift": "response"}
        files = [path for path in CONFIG.glob("*.toml") if "vehicle" in read(path)]
        self.assertGreaterEqual(len(files), 11)
        for path in files:
            self.assertIn(vehicle_file(path).name, ("vehicle.toml", "multirotor.toml"), path)
            program = programs.get(path.stem, path.stem.removesuffix("_multirotor"))
            done = subprocess.run([BINARIES / f"airworthy-{program}", "--check-config", "--config", path],
                                  capture_output=True, text=True, timeout=20)
            self.assertEqual((done.returncode, done.stderr), (0, ""), path)

    def test_the_table_of_the_sets_names_every_file(self):
        table = (PROJECT / "docs/configuration.md").read_text(encoding="utf-8")
        for path in CONFIG.glob("*.toml"):
            self.assertIn(f"`{path.name}`", table)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
