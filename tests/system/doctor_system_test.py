#!/usr/bin/python3
"""Runs airworthy-doctor in network namespaces that lack something, and then the cures it prints.

  doctor_system_test.py AIRWORTHY-DOCTOR
"""
import json
import os
import subprocess
import sys
import unittest

SKIPPED = 77
INSIDE = "DOCTOR_TEST_INSIDE_NAMESPACE"


def shell(command):
    subprocess.run(command, shell=True, check=True)


class Doctor(unittest.TestCase):
    program = ""

    def setUp(self):
        # Each test starts from a namespace as the kernel makes it: loopback down, no route.
        shell("ip link set lo down; ip route flush table main 2>/dev/null || true")  # there may be no table yet

    def examine(self, *arguments):
        run = subprocess.run([self.program, "--json", "--log-dir", "/", *arguments], capture_output=True, text=True,
                             check=False, timeout=30)
        report = json.loads(run.stdout)
        findings = {finding["id"]: finding for finding in report["findings"]}
        failures = [finding["id"] for finding in report["findings"] if finding["level"] == "failure"]
        self.assertEqual(report["failures"], len(failures))
        self.assertEqual(run.returncode, 1 if failures else 0)
        return findings, failures

    def test_a_bare_namespace_is_cured_by_the_printed_commands(self):
        findings, failures = self.examine()
        self.assertEqual(failures, ["multicast.loopback_up", "multicast.route"])
        self.assertEqual(findings["multicast.delivery"]["level"], "unknown")
        for failure in failures:
            shell(findings[failure]["cure"])
        findings, failures = self.examine()
        self.assertEqual(failures, [])
        for check in ("multicast.loopback_up", "multicast.route", "multicast.delivery"):
            self.assertEqual(findings[check]["level"], "ok", findings[check])

    def test_one_cause_at_a_time(self):
        shell("ip link set lo up")
        findings, failures = self.examine()
        self.assertEqual(failures, ["multicast.route"])
        self.assertEqual(findings["multicast.route"]["found"], "no route to the bus's group 239.255.76.67")

    def test_the_group_of_the_given_bus_is_examined(self):
        shell("ip link set lo up; ip route add 239.1.2.0/24 dev lo")
        self.assertEqual(self.examine("--lcm-url", "udpm://239.1.2.3:7667")[1], [])
        self.assertEqual(self.examine("--lcm-url", "udpm://239.1.3.3:7667")[1], ["multicast.route"])
        self.assertEqual(self.examine("--lcm-url", "memq://")[1], [])

    def test_routes_that_refuse_are_cured(self):
        for kind in ("unreachable", "prohibit", "blackhole"):
            with self.subTest(kind):
                shell(f"ip link set lo up; ip route flush table main; ip route add {kind} 224.0.0.0/4")
                findings, failures = self.examine()
                self.assertIn("multicast.route", failures)
                shell(findings["multicast.route"]["cure"])
                self.assertEqual(self.examine()[1], [])

    def test_too_many_groups_are_named(self):
        shell("ip link set lo up; ip route add 224.0.0.0/4 dev lo; sysctl -q -w net.ipv4.igmp_max_memberships=0")
        try:
            findings, failures = self.examine()
            self.assertEqual(failures, ["multicast.delivery"])
            self.assertIn("too many groups", findings["multicast.delivery"]["found"])
            shell(findings["multicast.delivery"]["cure"])
            self.assertEqual(self.examine()[1], [])
        finally:
            shell("sysctl -q -w net.ipv4.igmp_max_memberships=20")

    def test_a_bus_through_another_interface_is_a_warning(self):
        # lo goes under another name: this kernel may have no other kind of interface to offer.
        shell("ip link set lo name wlan0; ip link set wlan0 up; ip route add 224.0.0.0/4 dev wlan0")
        try:
            findings, failures = self.examine()
            self.assertEqual(failures, [])
            self.assertEqual(findings["multicast.route"]["level"], "warning")
            self.assertIn("wlan0", findings["multicast.route"]["found"])
        finally:
            shell("ip link set wlan0 down; ip link set wlan0 name lo")

    def test_wrong_arguments(self):
        for arguments in (["--no-such-option"], ["--lcm-url", "nonsense"]):
            run = subprocess.run([self.program, *arguments], capture_output=True, text=True, check=False)
            self.assertEqual((run.returncode, run.stdout), (64, ""), run.stderr)
            self.assertNotEqual(run.stderr, "")
        run = subprocess.run([self.program, "--help"], capture_output=True, text=True, check=False)
        self.assertEqual(run.returncode, 0)
        self.assertIn("--lcm-url", run.stdout)


def enter_namespace():
    """Runs this test again in a network namespace of its own, made as root or in a user namespace."""
    for unshare in (["unshare", "-n"], ["unshare", "-rn"]):
        if subprocess.run([*unshare, "true"], capture_output=True, check=False).returncode == 0:
            os.environ[INSIDE] = "yes"
            os.execvp(unshare[0], [*unshare, sys.executable, *sys.argv])
    print("no network namespace: unshare -n and unshare -rn are both refused here")
    sys.exit(SKIPPED)


if __name__ == "__main__":
    if INSIDE not in os.environ:
        enter_namespace()
    Doctor.program = sys.argv.pop(1)
    unittest.main(argv=sys.argv)
