#!/usr/bin/python3
"""Plays a recorded MAVLink stream into a pseudo-terminal at flight pace, as a flight controller on a serial line would.

  play_mavlink.py FLIGHT.tlog[.xz] --link PATH [--speed N] [--start-delay S] [--from S] [--until S]

PATH becomes a symbolic link to the terminal's device; the driver opens it like a serial port. A recording is a sequence
of (8-byte big-endian time in µs, packet). Only what the vehicle sent is played; what the ground station sent is left
out. Ends with the recording, or orderly on SIGTERM; prints what it played as one line of JSON.
"""
import argparse
import json
import lzma
import os
import pathlib
import select
import signal
import struct
import sys
import termios
import time
import tty

GROUND_STATION = 255


def packets(path):
    """Yields (time_us, system, message id, bytes). A broken file ends the program and names the offset."""
    opener = lzma.open if path.suffix == ".xz" else open
    try:
        with opener(path, "rb") as file:
            data = file.read()
    except (OSError, lzma.LZMAError, EOFError) as error:
        sys.exit(f"{path}: {error}")
    offset = 0
    while offset < len(data):
        header = data[offset:offset + 18]
        try:
            time_us = struct.unpack(">Q", header[:8])[0]
            magic, length = header[8], header[9]
            if magic == 0xFE:
                size, system, message = length + 8, header[11], header[13]
            elif magic == 0xFD:
                size = length + 12 + (13 if header[10] & 1 else 0)
                system, message = header[13], int.from_bytes(header[15:18], "little")
            else:
                sys.exit(f"{path}: byte {offset + 8}: 0x{magic:02x} is no start of a MAVLink packet")
        except (struct.error, IndexError):
            sys.exit(f"{path}: byte {offset}: truncated")
        packet = data[offset + 8:offset + 8 + size]
        if len(packet) < size:
            sys.exit(f"{path}: byte {offset}: truncated")
        yield time_us, system, message, packet
        offset += 8 + size


def open_terminal(link):
    master, slave = os.openpty()
    tty.setraw(slave, termios.TCSANOW)
    if link.is_symlink():
        link.unlink()
    link.symlink_to(os.ttyname(slave))
    return master, slave  # the slave stays open: the driver may come and go


def drain(master):
    """What the driver sends to the flight controller: read, so that it never blocks, and forgotten."""
    received = 0
    while select.select([master], [], [], 0)[0]:
        received += len(os.read(master, 4096))
    return received


def write_all(master, data, patience_s):
    """True if the line took the packet; like a serial line it drops what nobody reads."""
    deadline = time.monotonic() + patience_s
    while data:
        if not select.select([], [master], [], max(0.0, deadline - time.monotonic()))[1]:
            return False
        data = data[os.write(master, data):]
    return True


def play(arguments):
    master, slave = open_terminal(arguments.link)
    os.set_blocking(master, False)
    time.sleep(arguments.start_delay)
    counts, played, dropped, received, first_us, last_us, stalled = {}, 0, 0, 0, None, 0, False
    started, first_boottime_us = time.monotonic(), time.clock_gettime_ns(time.CLOCK_BOOTTIME) // 1000
    for time_us, system, message, packet in packets(arguments.flight):
        if system == GROUND_STATION:
            continue
        first_us = first_us if first_us is not None else time_us
        flown = (time_us - first_us) / 1e6
        if flown < arguments.skip:
            continue
        if flown > arguments.until:
            break
        wait = started + (flown - arguments.skip) / arguments.speed - time.monotonic()
        if wait > 0.001:
            received += drain(master)
            time.sleep(wait)
        # A line that nobody reads must not hold up the flight: what comes after a drop waits no more.
        stalled = not write_all(master, packet, 0.0 if stalled else 0.2)
        if stalled:
            dropped += 1
            continue
        counts[message] = counts.get(message, 0) + 1
        played, last_us = played + 1, time_us
    time.sleep(0.2)  # the driver reads what the terminal still holds
    received += drain(master)
    os.close(master)
    os.close(slave)
    arguments.link.unlink(missing_ok=True)
    print(json.dumps({"packets": played, "dropped": dropped, "flown_s": round((last_us - (first_us or 0)) / 1e6, 3),
                      "first_packet_utc_us": first_us, "first_packet_boottime_us": first_boottime_us,
                      "per_message": counts, "bytes_from_driver": received}), flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("flight", type=pathlib.Path)
    parser.add_argument("--link", type=pathlib.Path, required=True)
    parser.add_argument("--speed", type=float, default=1.0)
    parser.add_argument("--start-delay", type=float, default=0.0, help="seconds before the first packet")
    parser.add_argument("--from", dest="skip", type=float, default=0.0, help="start so many seconds into the flight")
    parser.add_argument("--until", type=float, default=float("inf"), help="stop so many seconds into the flight")
    arguments = parser.parse_args()
    if not arguments.speed > 0:
        parser.error("--speed must be greater than 0")
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    try:
        play(arguments)
    finally:
        arguments.link.unlink(missing_ok=True)


if __name__ == "__main__":
    main()
