#!/usr/bin/python3
"""Counts the tests of one ctest run from its --output-junit file.

  count_tests.py FILE.xml

Prints "passed failed skipped" and then a line for each skipped test: the whole program, or, as GoogleTest exits with
success although it skipped cases, the case with the reason it gave. A test that did not run for another reason (its
program is missing) has failed.
"""
import re
import sys
import xml.etree.ElementTree

SKIPPED_CASE = re.compile(r"^\[  SKIPPED \] (\S+) \(\d+ ms\)$", re.MULTILINE)


def reason(output, case):
    """What the case printed between its start and its skip; the last line is the text after GTEST_SKIP() <<."""
    body = output.partition(f"[ RUN      ] {case}\n")[2].partition("[  SKIPPED ]")[0]
    lines = [line for line in body.splitlines() if line.strip()]
    return lines[-1] if lines else "no reason given"


def count(root):
    passed, failed, skipped = 0, 0, []
    for test in root.iter("testcase"):
        name, output = test.get("name"), test.findtext("system-out") or ""
        status = test.get("status")
        cases = SKIPPED_CASE.findall(output)
        skipped += [f"{name}: {case}: {reason(output, case)}" for case in cases]
        message = test.find("skipped")
        if status == "run":
            passed += 1
        elif status == "notrun" and message is not None and "SKIP" in (message.get("message") or ""):
            skipped.append(f"{name}: {(output.strip().splitlines() or ['no reason given'])[-1]}")
        elif status == "disabled":
            skipped.append(f"{name}: disabled")
        else:
            failed += 1
    return passed, failed, skipped


def main(arguments):
    if len(arguments) != 1 or arguments[0] in ("-h", "--help"):
        sys.exit(__doc__.strip())
    passed, failed, skipped = count(xml.etree.ElementTree.parse(arguments[0]).getroot())
    print(passed, failed, len(skipped))
    for line in skipped:
        print(line)


if __name__ == "__main__":
    main(sys.argv[1:])
