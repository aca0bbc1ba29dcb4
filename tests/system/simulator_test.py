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
    def test_the_demonstration_flies_from_the_ground_and_loses_its_link(self):
        rig = self.rig(2.0)
        feed = self.feed(rig)
        rig.start_gateway(config="demo/gateway.toml")
        rig.start_response([f"vehicle={rig.config / 'vehicles/unbalance_hexa.toml'}"], config="response_multirotor.toml")
        for name in ("unbalance", "effectiveness", "actuator"):
            rig.start_service(f"airworthy-{name}", f"{name}.toml", [f"vehicle={rig.config / 'vehicles/unbalance_hexa.toml'}"])
        rig.start_driver(config="demo/mavlink.toml")
        up = feed.wait_for(lambda kind, document: kind == "health" and alive(document) >= {
            "airworthy-mavlink", "airworthy-response", "airworthy-unbalance", "airworthy-effectiveness",
            "airworthy-actuator"}, 20)
        self.assertIsNotNone(up, f"the system did not come up: {rig.dead()}")
        flight = rig.start_simulation("vehicles/unbalance_hexa.toml", "scenarios/demo.toml", "--duration", 24)
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


if __name__ == "__main__":
    unittest.main(verbosity=2)
