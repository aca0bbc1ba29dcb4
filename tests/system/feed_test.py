#!/usr/bin/python3
"""The gateway's feed and `airworthy watch`: real programs, no flight."""
import json
import random
import signal
import socket
import subprocess
import time
import unittest

from system_test import BINARIES, SystemTest

EX_USAGE, EX_UNAVAILABLE = 64, 69


class FeedTest(SystemTest):
    def setUp(self):
        self.system = self.rig(1.0)

    def watch(self, *arguments, timeout_s=20):
        return subprocess.run([BINARIES / "airworthy", "watch", self.system.endpoint, *arguments], timeout=timeout_s,
                              capture_output=True, text=True, check=False)

    def wait_for_feed(self):
        run = self.watch("--json", "--count", "1", "--timeout", "10")
        self.assertEqual(run.returncode, 0, run.stderr)

    def test_watch_prints_json_for_scripts(self):
        self.system.start_gateway()
        run = self.watch("--json", "--count", "3", "--timeout", "10")
        self.assertEqual(run.returncode, 0, run.stderr)
        documents = [json.loads(line) for line in run.stdout.splitlines()]
        self.assertEqual(len(documents), 3)
        for document in documents:
            self.assertEqual((document["schema"], document["kind"]), (1, "health"))
            self.assertIsNotNone(document["time_utc"])
        numbers = [document["sequence"] for document in documents]
        self.assertEqual(numbers, list(range(numbers[0], numbers[0] + 3)))

    def test_watch_without_a_gateway_says_so(self):
        run = self.watch("--timeout", "2.5")
        self.assertEqual(run.returncode, EX_UNAVAILABLE)
        self.assertIn(f"no data from {self.system.endpoint} for 2 s", run.stdout)

    def test_watch_follows_a_killed_and_restarted_gateway(self):
        self.system.start_gateway()
        self.wait_for_feed()
        watch = subprocess.Popen([BINARIES / "airworthy", "watch", self.system.endpoint], stdout=subprocess.PIPE,
                                 text=True)
        time.sleep(1.0)
        self.system.stop("airworthy-gateway", signal.SIGKILL)
        time.sleep(2.6)
        self.system.start_gateway()
        time.sleep(2.5)
        watch.send_signal(signal.SIGINT)
        output, _ = watch.communicate(timeout=5)
        self.assertEqual(watch.returncode, 0)
        told = [output.find(text) for text in (f"no data from {self.system.endpoint}", "data again from",
                                               "the gateway restarted")]
        self.assertNotIn(-1, told, output)
        self.assertEqual(told, sorted(told), output)

    def test_a_second_gateway_fails_clearly(self):
        self.system.start_gateway()
        self.wait_for_feed()
        second = subprocess.run([BINARIES / "airworthy-gateway", "--config", self.system.config / "gateway.toml",
                                 "--lcm-url", self.system.lcm_url, "--set", f"feed.endpoint={self.system.endpoint}"],
                                capture_output=True, text=True, check=False, timeout=10)
        self.assertEqual(second.returncode, EX_UNAVAILABLE)
        self.assertIn(f"cannot serve the feed at {self.system.endpoint}: Address already in use", second.stderr)

    def test_garbage_on_the_port_does_not_hurt(self):
        self.system.start_gateway()
        self.wait_for_feed()
        port = int(self.system.endpoint.rsplit(":", 1)[1])
        noise = random.Random(1)
        # ZeroMQ's greeting, so that some garbage gets past it.
        greeting = b"\xff" + bytes(8) + b"\x7f\x03\x00NULL" + bytes(16) + b"\x00" + bytes(31)
        for i in range(40):
            with socket.create_connection(("127.0.0.1", port), timeout=5) as connection:
                try:
                    connection.sendall((greeting if i % 2 else b"") + noise.randbytes(noise.randrange(1, 100000)))
                except OSError:
                    pass  # cut off, as it should be
        run = self.watch("--json", "--count", "5", "--timeout", "10")
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assert_alive(self.system)

    def test_an_orderly_end(self):
        self.system.start_gateway()
        self.wait_for_feed()
        self.assertEqual(self.system.stop("airworthy-gateway"), 0)

    def test_a_detector_that_is_killed_and_one_that_is_stopped(self):
        self.system.start_gateway()
        feed = self.feed(self.system)

        def wait(status, timeout_s):
            return feed.wait_for(lambda kind, document: kind == "health" and any(
                process["process"] == "airworthy-response" and process["status"] == status
                for process in document["processes"]), timeout_s, len(feed.messages))

        self.system.start_response()
        self.assertIsNotNone(wait("running", 10))
        self.assertIsNotNone(feed.wait_for(lambda kind, document: kind == "health" and document["components"], 5))
        self.system.stop("airworthy-response", signal.SIGKILL)
        killed = time.monotonic()
        missing = wait("missing", 5)
        self.assertIsNotNone(missing)
        print(f"missing after {missing[0] - killed:.2f} s")
        self.assertLessEqual(missing[0] - killed, 1.0)
        reasons = {reason for component in missing[3]["components"] for reason in component["reasons"]}
        self.assertEqual(reasons, {"airworthy-response is missing"})
        self.system.start_response()
        self.assertIsNotNone(wait("running", 10))
        self.system.stop("airworthy-response")
        stopped = wait("stopped", 5)
        self.assertIsNotNone(stopped)
        response = [process for process in stopped[3]["processes"] if process["process"] == "airworthy-response"][0]
        self.assertEqual(response["restarts"], 1)

    def test_unknown_commands(self):
        for arguments in (["nonsense"], ["../airworthy-watch"], ["--nonsense"], []):
            run = subprocess.run([BINARIES / "airworthy", *arguments], capture_output=True, text=True, check=False)
            self.assertEqual((run.returncode, run.stdout), (EX_USAGE, ""), arguments)
            self.assertNotEqual(run.stderr, "")
        run = subprocess.run([BINARIES / "airworthy", "--help"], capture_output=True, text=True, check=False)
        self.assertEqual(run.returncode, 0)
        self.assertIn("\n  watch ", run.stdout)
        run = subprocess.run([BINARIES / "airworthy", "help", "watch"], capture_output=True, text=True, check=False)
        self.assertEqual(run.returncode, 0)
        self.assertIn("--json", run.stdout)


if __name__ == "__main__":
    unittest.main(verbosity=2)
