#!/usr/bin/python3
"""Processes killed in mid-flight: named within a second, well again within two of their restart."""
import signal
import time

import system_test
from system_test import SystemTest, alive, flights

SPEED = 1.0  # deadlines are judged in real time here
FLIGHT = "carbonZ_2018-10-18-11-04-35_engine_failure_with_emr_traj"
SKIP_S = 40.0  # the fault comes 61 s later: enough to learn the flight


class Restart(SystemTest):
    def setUp(self):
        self.system = self.rig(SPEED)
        self.ground = self.feed(self.system)
        self.start_system(self.system, self.ground)
        self.system.start_flight(flights(FLIGHT)[FLIGHT], "--from", str(SKIP_S))

    def wait_health(self, condition, timeout_s):
        """Seconds until a health message, sent from now on, satisfies the condition; None if none does."""
        started, seen = time.monotonic(), len(self.ground.messages)
        found = self.ground.wait_for(lambda kind, document: kind == "health" and condition(document), timeout_s, seen)
        return None if found is None else found[0] - started

    def kill(self, name):
        process = self.system.running.pop(name)
        process.send_signal(signal.SIGKILL)
        process.wait()

    def check_kill(self, name, restart):
        time.sleep(2.0)
        self.ground.poll(0)
        self.kill(name)
        named = self.wait_health(lambda health: any(
            process["process"] == name and process["status"] == "missing" for process in health["processes"])
            and name in health["root_cause"], 3.0)
        self.assertIsNotNone(named, f"{name} was never named as missing")
        restart()
        well = self.wait_health(lambda health: name in alive(health) and all(
            process["status"] == "running" for process in health["processes"] if process["expected"])
            and name not in health["root_cause"], 5.0)
        print(f"{name}: named after {named:.2f} s, running again {'%.2f' % well if well else 'never'} s after its restart")
        self.assertLessEqual(named, 1.0)
        self.assertIsNotNone(well)
        self.assertLessEqual(well, 2.0)

    def test_detector(self):
        self.check_kill("airworthy-response", self.system.start_response)

    def test_driver(self):
        self.check_kill("airworthy-mavlink", self.system.start_driver)

    def test_gateway_with_an_active_fault(self):
        raised = self.ground.wait_for(lambda kind, document: kind == "event" and document["event"]["phase"] == "raise", 80.0)
        self.assertIsNotNone(raised, "the fault was not found")
        self.kill("airworthy-gateway")
        self.system.start_gateway()
        started = time.monotonic()
        full = self.wait_health(lambda health: {"airworthy-mavlink", "airworthy-response"} <= alive(health) and any(
            fault["component"] == raised[3]["event"]["component"] and fault["number"] == raised[3]["event"]["number"]
            for fault in health["faults"]) and health["links"], 5.0)
        self.assertIsNotNone(full, "the restarted gateway does not show the active fault")
        print(f"gateway: full state {full:.2f} s after its restart")
        self.assertLessEqual(time.monotonic() - started, 5.0)
        self.assertLessEqual(full, 1.0)


if __name__ == "__main__":
    system_test.main()
