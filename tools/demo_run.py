#!/usr/bin/python3
"""Runs the whole system live: gateway, detectors and MAVLink driver as separate processes, a flight controller on a
pseudo-terminal, and the view of a ground station in this terminal. The flight controller is that of a simulated hexarotor,
which is first calibrated on a healthy flight and then loses its link for a while, a bit of one propeller and all of
another; or it is a recorded flight."""
import argparse
import csv
import json
import os
import pathlib
import signal
import subprocess
import sys
import time
import tomllib

import flight_rig

DATA = pathlib.Path(os.environ.get("AIRWORTHY_DATA", flight_rig.PROJECT.parent / "shared/data"))
VEHICLE = "multirotor.toml"
SCENARIO = "scenarios/demo.toml"
HEALTHY = "scenarios/healthy_manoeuvres.toml"


def arguments():
    parser = argparse.ArgumentParser(prog="tools/demo", description=__doc__)
    parser.add_argument("flight", nargs="?", type=pathlib.Path, metavar="TLOG",
                        help="recorded MAVLink, .tlog or .tlog.xz, instead of the simulated flight")
    parser.add_argument("--seed", type=int, default=1, help="of the simulated flight")
    parser.add_argument("--speed", type=float, default=1.0, help="times flight pace; vehicle time runs as fast")
    parser.add_argument("--from", dest="skip", type=float, default=0.0, help="start so many seconds into a recorded flight")
    parser.add_argument("--json", action="store_true", help="print the feed as lines of JSON instead of the view")
    parser.add_argument("--binaries", type=pathlib.Path, default=flight_rig.PROJECT / "build/dev/bin",
                        help="folder of the built programs")
    given = parser.parse_args()
    if not given.speed > 0:
        parser.error("--speed must be greater than 0")
    if given.flight is not None and not given.flight.exists():
        parser.error(f"{given.flight}: no such file")
    return given


def recorded_onset_utc_us(flight):
    """When the fault of an ALFA flight began, if its index is at hand."""
    index = DATA / "alfa/index.csv"
    if not index.exists():
        return None
    with open(index, encoding="utf-8") as file:
        for row in csv.DictReader(file):
            if row["sequence"] == flight.name.split(".tlog")[0] and row["fault_onset_ns"]:
                return int(row["fault_onset_ns"]) // 1000
    return None


def check_computer(binaries, lcm_url):
    """Stops where messages could not flow, with the doctor's words."""
    doctor = subprocess.run([binaries / "airworthy-doctor", "--lcm-url", lcm_url], capture_output=True, text=True)
    if doctor.returncode != 0:
        sys.exit(f"{doctor.stdout}{doctor.stderr}demo: this computer cannot run the system yet; cures above")


def onsets_into_flight_s(flight, summary):
    """Seconds into the flight at which something broke, as far as known."""
    if flight is None:
        with open(flight_rig.PROJECT / "config" / SCENARIO, "rb") as file:
            return {f"{fault['kind']} of " + (f"rotor {fault['rotor']}" if "rotor" in fault else f"the link to the {fault['link']}"):
                    fault["onset_s"] for fault in tomllib.load(file)["fault"]}
    onset_us = recorded_onset_utc_us(flight)
    return {} if onset_us is None else {"failure on record": (onset_us - summary["first_packet_utc_us"]) / 1e6}


def report(feed, rig, flight, speed):
    """What was found, against the truth."""
    feed.poll(0)
    try:
        summary = json.loads((rig.path / "flight.json").read_text())
    except (OSError, ValueError):
        return
    start_us = summary["start_boottime_us" if flight is None else "first_packet_boottime_us"] * speed
    onsets = onsets_into_flight_s(flight, summary)
    for name, onset_s in onsets.items():
        print(f"demo: {name} at {onset_s:.1f} s of the flight")
    for event in feed.events():
        flown_s = (event["detected_us"] - start_us) / 1e6
        text = f"demo: {event['component']}: {event['fault_kind']}, {event['severity']}, raised {flown_s:.1f} s into the flight"
        before = [(flown_s - onset_s, name) for name, onset_s in onsets.items() if onset_s <= flown_s]
        if before:
            text += f", {min(before)[0]:+.2f} s from the {min(before)[1]}"
        print(text)
    if not feed.events():
        print("demo: no fault was found in this flight")


def calibrated(rig, seed):
    """Flies the vehicle healthy, in other air, and lets the detectors learn it; returns each one's calibration file."""
    print("demo: calibrating on a healthy flight")
    log = rig.path / "healthy.lcm"
    files = {name: rig.path / f"{name}_calibration.toml" for name in ("unbalance", "effectiveness")}
    steps = [[rig.binaries / "airworthy-sim", "--vehicle", rig.config / VEHICLE, "--scenario", rig.config / HEALTHY,
              "--vehicle-seed", seed, "--seed", seed + 1000, "--output", log]]
    steps += [[rig.binaries / "airworthy-calibrate", name, "--config", rig.config / f"{name}.toml", "--output", file, log] for name, file in files.items()]
    for step in steps:
        done = subprocess.run([str(part) for part in step], capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(f"{done.stdout}{done.stderr}demo: the vehicle could not be calibrated")
    return files


def run(given):
    with flight_rig.Rig(given.binaries, given.speed) as rig:
        check_computer(given.binaries, rig.lcm_url)
        if given.flight is None:
            calibration = calibrated(rig, given.seed)
            rig.start_gateway(config="gateway_multirotor.toml")
            for name, file in calibration.items():
                rig.start_service(f"airworthy-{name}", f"{name}.toml", [f"calibration={file}"])
            rig.start_service("airworthy-actuator", "actuator.toml")
            rig.start_response(config="response_multirotor.toml")
            rig.start_driver(config="mavlink_multirotor.toml")
            feed = flight_rig.Feed(rig.endpoint)
            flight = rig.start_simulation(VEHICLE, SCENARIO, "--seed", given.seed)
        else:
            rig.start_gateway()
            rig.start_response()
            rig.start_driver()
            feed = flight_rig.Feed(rig.endpoint)
            flight = rig.start_flight(given.flight, "--start-delay", "2", "--from", given.skip)
        watch = subprocess.Popen([given.binaries / "airworthy-watch", rig.endpoint, *(["--json"] if given.json else [])],
                                 stdin=subprocess.DEVNULL, preexec_fn=flight_rig.die_with_parent)
        rig.running["watch"] = watch
        rig.logs["watch"] = pathlib.Path(os.devnull)
        try:
            while flight.poll() is None and not rig.dead():
                feed.poll(0.2)
            time.sleep(1.0)
        except KeyboardInterrupt:
            pass
        dead = rig.dead()
        rig.stop("watch")
        print()
        report(feed, rig, given.flight, given.speed)
        feed.close()
        for name, (code, log) in dead.items():
            print(f"demo: {name} ended with {code}:\n{log}", file=sys.stderr)
        if flight.poll() not in (None, 0):
            print((rig.path / "flight.log").read_text(), file=sys.stderr)
            return 1
        return 1 if dead else 0


def main():
    given = arguments()
    signal.signal(signal.SIGTERM, lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
    try:
        sys.exit(run(given))
    except KeyboardInterrupt:
        sys.exit(130)


if __name__ == "__main__":
    main()
