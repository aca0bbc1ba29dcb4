"""Starts and stops the processes of the system around a played flight. Used by tools/demo and the system tests."""
import ctypes
import json
import os
import pathlib
import signal
import socket
import subprocess
import sys
import tempfile
import time

PROJECT = pathlib.Path(__file__).resolve().parent.parent
PR_SET_PDEATHSIG = 1


def die_with_parent():
    """The kernel ends the child when this process dies, however it dies."""
    ctypes.CDLL("libc.so.6").prctl(PR_SET_PDEATHSIG, signal.SIGTERM)


def free_port(kind=socket.SOCK_STREAM):
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Rig:
    """Gateway, response detector and MAVLink driver on a bus of their own, and a flight played into the driver."""

    def __init__(self, binaries, speed=1.0, vehicle=None, clock_of_detectors="live"):
        self.binaries = pathlib.Path(binaries)
        self.speed = speed
        self.clock = clock_of_detectors
        self.folder = tempfile.TemporaryDirectory(prefix="airworthy-")
        self.path = pathlib.Path(self.folder.name)
        self.lcm_url = f"udpm://239.255.76.67:{free_port(socket.SOCK_DGRAM)}?ttl=0"
        self.endpoint = f"tcp://127.0.0.1:{free_port()}"
        self.terminal = self.path / "flight_controller"
        self.config = PROJECT / "config"
        self.vehicle = vehicle
        self.running = {}
        self.logs = {}

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop_all()
        self.folder.cleanup()

    def start(self, name, command, output=None):
        """Starts a program of ours or of LCM; its messages go to <folder>/<name>.log."""
        log = open(self.path / f"{name}.log", "ab")
        self.logs[name] = self.path / f"{name}.log"
        environment = dict(os.environ, LCM_DEFAULT_URL=self.lcm_url)
        self.running[name] = subprocess.Popen(
            [str(part) for part in command], stdin=subprocess.DEVNULL, stdout=output or log, stderr=log,
            env=environment, preexec_fn=die_with_parent)
        log.close()
        return self.running[name]

    def start_service(self, name, config, overrides=(), clock=None):
        clock = clock or self.clock
        command = [self.binaries / name, "--config", self.config / config, "--lcm-url", self.lcm_url, "--clock", clock]
        if clock == "live":
            command += ["--time-scale", self.speed]
        for override in overrides:
            command += ["--set", override]
        return self.start(name, command)

    def start_gateway(self, overrides=(), config="gateway.toml"):
        return self.start_service("airworthy-gateway", config,
                                  [f'feed.endpoint="{self.endpoint}"', *overrides])

    def start_response(self, overrides=(), config="response.toml"):
        return self.start_service("airworthy-response", config, overrides)

    def start_driver(self, overrides=(), config="mavlink.toml"):
        return self.start_service("airworthy-mavlink", config,
                                  [f'link="serial:{self.terminal}:57600"', *overrides], clock="live")

    def start_simulation(self, vehicle, scenario, *options):
        """Flies a simulated vehicle; its JSON summary is in <folder>/flight.json when it has ended."""
        with open(self.path / "flight.json", "wb") as output:
            return self.start("flight", [self.binaries / "airworthy-sim", "--vehicle", self.config / vehicle, "--scenario",
                                         self.config / scenario, "--live", self.terminal, "--speed", self.speed, "--json",
                                         *options], output)

    def start_flight(self, flight, *options):
        """Plays a recording; its JSON summary is in <folder>/flight.json when it has ended."""
        with open(self.path / "flight.json", "wb") as output:
            return self.start("flight", ["/usr/bin/python3", PROJECT / "tools/play_mavlink.py", flight, "--link",
                                         self.terminal, "--speed", self.speed, *options], output)

    def stop(self, name, signal_number=signal.SIGTERM, timeout_s=5.0):
        process = self.running.pop(name, None)
        if process is None:
            return None
        if process.poll() is None:
            process.send_signal(signal_number)
        try:
            return process.wait(timeout_s)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            raise

    def stop_all(self):
        for name in list(self.running):
            try:
                self.stop(name)
            except subprocess.TimeoutExpired:
                print(f"{name} did not stop on SIGTERM and was killed", file=sys.stderr)

    def dead(self):
        """Programs that ended without being told to, with the last lines they wrote."""
        ended = {}
        for name, process in self.running.items():
            if name != "flight" and process.poll() is not None:
                ended[name] = (process.returncode, self.logs[name].read_text(errors="replace")[-2000:])
        return ended


class Feed:
    """A ground client of the gateway's ZeroMQ feed: collects (arrival time, kind, document)."""

    def __init__(self, endpoint):
        import zmq  # Debian's python3-zmq; only those who listen need it
        self.zmq = zmq
        self.context = zmq.Context()
        self.socket = self.context.socket(zmq.SUB)
        self.socket.setsockopt(zmq.RCVHWM, 100000)
        self.socket.setsockopt(zmq.SUBSCRIBE, b"airworthy/")
        self.socket.connect(endpoint)
        self.messages = []

    def close(self):
        self.socket.close(0)
        self.context.term()

    def poll(self, timeout_s=0.05):
        """Reads what has arrived; true if anything did."""
        if not self.socket.poll(max(0, int(timeout_s * 1000))):
            return False
        while self.socket.poll(0):
            topic, sequence, document = self.socket.recv_multipart()
            kind = topic.decode().rsplit("/", 1)[1]
            self.messages.append((time.monotonic(), kind, int(sequence), json.loads(document)))
        return True

    def wait_for(self, condition, timeout_s, since=0):
        """The first message (arrival, kind, sequence, document) at or after index `since` that satisfies the condition."""
        deadline = time.monotonic() + timeout_s
        index = since
        while True:
            while index < len(self.messages):
                if condition(self.messages[index][1], self.messages[index][3]):
                    return self.messages[index]
                index += 1
            remaining = deadline - time.monotonic()
            if remaining <= 0:
                return None
            self.poll(min(0.05, remaining))

    def events(self, phase="raise"):
        """The faults raised (updated, cleared) so far, in order."""
        return [document["event"] for _, kind, _, document in self.messages
                if kind == "event" and document["event"]["phase"] == phase]
