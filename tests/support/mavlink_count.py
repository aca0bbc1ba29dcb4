#!/usr/bin/python3
"""Counts the packets of a MAVLink telemetry log (.tlog or .tlog.xz) by message id and prints them as JSON.

  mavlink_count.py LOG [--system N] [--component N] [--reference crc_extra.csv]

An independent oracle for the C++ parser: it follows the log's own framing and shares no code or table with it. With
--reference (msgid, name, crc_extra, ...) it also checks every checksum, bit by bit.
"""
import argparse
import collections
import csv
import json
import lzma
import pathlib
import struct
import sys


def packets(log):
    """Yields (offset, time_us, packet); raises ValueError with the offset where the log is broken."""
    at = 0
    while at < len(log):
        if at + 10 > len(log):
            raise ValueError(f"offset {at}: cut off inside a record")
        (time_us,) = struct.unpack_from(">Q", log, at)
        start, length, flags = log[at + 8], log[at + 9], log[at + 10]
        if start == 0xFE:
            size = 8 + length
        elif start == 0xFD:
            size = 12 + length + (13 if flags & 1 else 0)
        else:
            raise ValueError(f"offset {at}: no start byte")
        if at + 8 + size > len(log):
            raise ValueError(f"offset {at}: cut off inside a record")
        yield at, time_us, log[at + 8:at + 8 + size]
        at += 8 + size


def address(packet):
    """(message id, system, component) of a packet."""
    if packet[0] == 0xFE:
        return packet[5], packet[3], packet[4]
    return int.from_bytes(packet[7:10], "little"), packet[5], packet[6]


def checksum(data):
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ 0x8408 if crc & 1 else crc >> 1
    return crc


def is_intact(packet, crc_extra):
    end = (6 if packet[0] == 0xFE else 10) + packet[1]
    return checksum(packet[1:end] + bytes([crc_extra])) == int.from_bytes(packet[end:end + 2], "little")


def count(log, system=None, component=None, seeds=None):
    by_id, by_sender, bad, unknown = (collections.Counter() for _ in range(4))
    for _, _, packet in packets(log):
        message, from_system, from_component = address(packet)
        if system not in (None, from_system) or component not in (None, from_component):
            continue
        if seeds is not None and message not in seeds:
            unknown[message] += 1
        elif seeds is not None and not is_intact(packet, seeds[message]):
            bad[message] += 1
            continue
        by_id[message] += 1
        by_sender[f"{from_system}/{from_component}"] += 1
    return {"messages": {str(i): n for i, n in sorted(by_id.items())}, "senders": dict(sorted(by_sender.items())),
            "bad_checksum": sum(bad.values()), "not_in_reference": {str(i): n for i, n in sorted(unknown.items())}}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("log", type=pathlib.Path)
    parser.add_argument("--system", type=int)
    parser.add_argument("--component", type=int)
    parser.add_argument("--reference", type=pathlib.Path)
    arguments = parser.parse_args()
    data = arguments.log.read_bytes()
    if arguments.log.suffix == ".xz":
        data = lzma.decompress(data)
    seeds = None
    if arguments.reference:
        with arguments.reference.open(newline="") as file:
            seeds = {int(row["msgid"]): int(row["crc_extra"]) for row in csv.DictReader(file)}
    try:
        print(json.dumps(count(data, arguments.system, arguments.component, seeds), indent=1))
    except ValueError as error:
        sys.exit(f"{arguments.log}: {error}")


if __name__ == "__main__":
    main()
