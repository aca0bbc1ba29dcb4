#!/usr/bin/python3
"""A simulated vehicle flown live: its flight controller on a pseudo-terminal, the real driver, the real gateway."""
import json
import unittest

from system_test import SystemTest, alive

PATIENCE_S = 40


def rate(health, name):
    """Messages a second of one kind on the vehicle's link, by its own clock."""
    return next((entry["rate_Hz"] for link in health["links"] for entry in link["rates"] if entry["name"] == name), 0.0)


class SimulatorTest(SystemTest):
    DETECTORS = ("unbalance", "effectiveness", "actuator")
    HEXACOPTER = "multirotor.toml"

    def start_detector(self, rig, name):
        rig.start_service(f"airworthy-{name}", f"{name}.toml")

    def start_driver(self, rig):
        rig.start_driver(config="mavlink_multirotor.toml")

    def start_all(self, rig, feed):
        rig.start_gateway(config="gateway_multirotor.toml")
        rig.start_response(config="response_multirotor.toml")
        for name in self.DETECTORS:
            self.start_detector(rig, name)
        self.start_driver(rig)
        up = feed.wait_for(lambda kind, document: kind == "health" and alive(document) >= {
            "airworthy-mavlink", "airworthy-response", *(f"airworthy-{name}" for name in self.DETECTORS)}, 20)
        self.assertIsNotNone(up, f"the system did not come up: {rig.dead()}")

    def test_the_demonstration_flies_from_the_ground_and_loses_its_link(self):
        rig = self.rig(2.0)
        feed = self.feed(rig)
        self.start_all(rig, feed)
        flight = rig.start_simulation(self.HEXACOPTER, "scenarios/demo.toml", "--duration", 24)
        for phase in ("on_ground", "in_flight"):
            self.assertIsNotNone(feed.wait_for(lambda kind, document, phase=phase: kind == "health" and
                                               document["flight_phase"] == phase, PATIENCE_S), phase)
        # The lost link of the scenario is all but ESC telemetry; then everything comes back.
        for sample_rate, why in ((lambda rate_Hz: rate_Hz < 1.0, "lost"), (lambda rate_Hz: rate_Hz > 400.0, "back")):
            seen = feed.wait_for(lambda kind, document, wanted=sample_rate: kind == "health" and
                                 document["flight_phase"] == "in_flight" and wanted(rate(document, "HIGHRES_IMU")) and
                                 rate(document, "ESC_STATUS") > 150.0, PATIENCE_S, since=len(feed.messages))
            self.assertIsNotNone(seen, f"the link is {why}")
        self.assertEqual(flight.wait(PATIENCE_S), 0)
        summary = json.loads((rig.path / "flight.json").read_text())
        self.assertAlmostEqual(summary["flown_s"], 24.0, delta=0.01)
        self.assert_alive(rig)

    def test_a_process_killed_in_flight_is_named_and_the_others_blame_nobody(self):
        rig = self.rig(1.0)
        feed = self.feed(rig)
        self.start_all(rig, feed)
        rig.start_simulation(self.HEXACOPTER, "scenarios/healthy_hover.toml", "--duration", 45)
        flies = feed.wait_for(lambda kind, document: kind == "health" and document["flight_phase"] == "in_flight",
                              PATIENCE_S)
        self.assertIsNotNone(flies, "it did not take off")
        restarts = [(f"airworthy-{name}", lambda name=name: self.start_detector(rig, name)) for name in self.DETECTORS]
        for name, restart in [*restarts, ("airworthy-mavlink", lambda: self.start_driver(rig))]:
            process = rig.running.pop(name)
            process.kill()
            process.wait()
            since = len(feed.messages)
            named = feed.wait_for(lambda kind, document, name=name: kind == "health" and any(
                entry["process"] == name and entry["status"] == "missing" for entry in document["processes"]), 5, since)
            self.assertIsNotNone(named, f"{name} was never named as missing")
            restart()
            since = len(feed.messages)
            well = feed.wait_for(lambda kind, document: kind == "health" and all(
                entry["status"] == "running" for entry in document["processes"] if entry["expected"]), 10, since)
            self.assertIsNotNone(well, f"{name} was never seen again")
        settled_s = 8.0  # long enough for every detector to judge again
        feed.wait_for(lambda kind, document: kind == "event" and document["event"]["phase"] == "raise", settled_s)
        self.assertEqual([event["summary"] for event in feed.events()], [])
        last = next(document for _, kind, _, document in reversed(feed.messages) if kind == "health")
        self.assertEqual(last["flight_phase"], "in_flight", "the flight ended too early to show anything")
        self.assert_alive(rig)


if __name__ == "__main__":
    unittest.main(verbosity=2)
