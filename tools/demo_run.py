#!/usr/bin/python3
"""Runs the whole system live on a recorded flight: gateway, response detector and MAVLink driver as separate processes, the
recording played into a pseudo-terminal, and the view of a ground station in this terminal."""
import argparse
import csv
import json
import os
import pathlib
import signal
import subprocess
import sys
import time

import flight_rig

DATA = pathlib.Path(os.environ.get("AIRWORTHY_DATA", flight_rig.PROJECT.parent / "shared/data"))
DEFAULT_FLIGHT = "alfa_mavlink/carbonZ_2018-10-05-15-52-12_3_engine_failure_with_emr_traj.tlog.xz"


def arguments():
    parser = argparse.ArgumentParser(prog="tools/demo", description=__doc__)
    parser.add_argument("flight", nargs="?", type=pathlib.Path, metavar="TLOG",
                        help=f"recorded MAVLink, .tlog or .tlog.xz; default {DEFAULT_FLIGHT} in AIRWORTHY_DATA")
    parser.add_argument("--speed", type=float, default=1.0, help="times flight pace; vehicle time runs as fast")
    parser.add_argument("--from", dest="skip", type=float, default=0.0, help="start so many seconds into the flight")
    parser.add_argument("--json", action="store_true", help="print the feed as lines of JSON instead of the view")
    parser.add_argument("--binaries", type=pathlib.Path, default=flight_rig.PROJECT / "build/dev/bin",
                        help="folder of the built programs")
    given = parser.parse_args()
    if not given.speed > 0:
        parser.error("--speed must be greater than 0")
    if given.flight is None:
        given.flight = DATA / DEFAULT_FLIGHT
        if not given.flight.exists():
            parser.error(f"no flight data at {DATA}: pass a recorded MAVLink flight (.tlog or .tlog.xz), or set "
                         "AIRWORTHY_DATA to a folder with the ALFA recordings")
    if not given.flight.exists():
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


def report(feed, rig, flight, speed):
    """What was found, against the record."""
    feed.poll(0)
    try:
        summary = json.loads((rig.path / "flight.json").read_text())
    except (OSError, ValueError):
        return
    onset_us = recorded_onset_utc_us(flight)
    for event in feed.events():
        flown_us = event["detected_us"] - summary["first_packet_boottime_us"] * speed
        text = f"demo: {event['component']}: {event['fault_kind']}, {event['severity']}, raised {flown_us / 1e6:.1f} s into the flight"
        if onset_us is not None:
            text += f", {(summary['first_packet_utc_us'] + flown_us - onset_us) / 1e6:+.2f} s from the recorded onset"
        print(text)
    if not feed.events():
        print("demo: no fault was found in this flight" + ("" if onset_us is None else ", but one is on record"))


def run(given):
    with flight_rig.Rig(given.binaries, given.speed) as rig:
        check_computer(given.binaries, rig.lcm_url)
        rig.start_gateway()
        rig.start_response()
        rig.start_driver()
        feed = flight_rig.Feed(rig.endpoint)
        flight = rig.start_flight(given.flight, "--start-delay", "2", "--from", str(given.skip))
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
