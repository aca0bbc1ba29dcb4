#!/usr/bin/python3
"""Recorded flights end to end: bytes, pseudo-terminal, driver, LCM multicast, detector, gateway, a ZeroMQ client."""
import concurrent.futures
import json

import system_test
from system_test import SystemTest, flights, truth

SPEED = 8.0
AT_ONCE = 3


def fly(test, name, path):
    """Plays a flight through a system of its own. Returns (raised events with their delay from the onset, flight summary)."""
    onset_us = truth()[name]
    rig = test.rig(SPEED)
    feed = test.feed(rig)
    test.start_system(rig, feed)
    flight = rig.start_flight(path, "--start-delay", "0.5")
    while flight.poll() is None:
        feed.poll(0.2)
    feed.poll(0.5)
    test.assert_alive(rig)
    summary = json.loads((rig.path / "flight.json").read_text())
    links = [document["links"] for _, kind, _, document in feed.messages if kind == "health"][-1]
    rig.stop_all()
    alarms = []
    for event in feed.events():
        # Vehicle time of the flight's first packet, from the player's own clock reading.
        flown_us = event["detected_us"] - summary["first_packet_boottime_us"] * SPEED
        utc_us = summary["first_packet_utc_us"] + flown_us
        delay_s = None if onset_us is None else (utc_us - onset_us) / 1e6
        alarms.append((event["component"], delay_s, flown_us / 1e6))
    return alarms, summary, links


class Flights(SystemTest):
    def fly_all(self, chosen):
        self.assertTrue(chosen)
        with concurrent.futures.ThreadPoolExecutor(AT_ONCE) as pool:
            results = dict(zip(chosen, pool.map(lambda item: fly(self, *item), chosen.items())))
        for name, (alarms, summary, _) in results.items():
            print(f"{name}: {summary['packets']} packets, alarms " +
                  (", ".join(f"{component} {'%+.2f s' % delay if delay is not None else 'at %.1f s' % flown}"
                             for component, delay, flown in alarms) or "none"))
        return results

    def test_engine_failures_are_found(self):
        results = self.fly_all(flights("engine_failure"))
        found = [alarms[0][1] for alarms, _, _ in results.values()
                 if alarms and alarms[0][0] == "engine" and 0 <= alarms[0][1]]
        print(f"engine: found {len(found)} of {len(results)}, median {sorted(found)[len(found) // 2]:.2f} s, "
              f"max {max(found):.2f} s")
        early = [name for name, (alarms, _, _) in results.items() if alarms and alarms[0][1] < 0]
        self.assertEqual(early, [], "an alarm before the fault")
        self.assertGreaterEqual(len(found), len(results) - 3)
        self.assertLessEqual(sorted(found)[len(found) // 2], 2.0)

    def test_rudder_failures_are_found(self):
        results = self.fly_all(flights("rudder_right", "rudder_left"))
        for name, (alarms, _, _) in results.items():
            self.assertTrue(alarms, name)
            self.assertEqual(alarms[0][0], "lateral control", name)
            self.assertTrue(0 <= alarms[0][1] <= 2.0, f"{name}: {alarms}")

    def test_healthy_flights_stay_silent(self):
        for name, (alarms, _, _) in self.fly_all(flights("no_failure")).items():
            self.assertEqual(alarms, [], name)


if __name__ == "__main__":
    system_test.main()
