#!/usr/bin/python3
"""Tests of the tables of tools/evidence_isolation.py on made-up flights."""
import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tools"))
import evidence_isolation  # noqa: E402
from evidence_page import Failed  # noqa: E402


def flight(felt_m_s2, candidates):
    """Of the 39 g vehicle with damage on rotor 1, which nobody is named for."""
    return evidence_isolation.parsed(
        f"rotors_alike;small;hover;1;1;;0 0 0 0;{felt_m_s2} 0 0 0;0 0 0 0;0 0 0 0;0 0 0 0;{candidates};40.0;20.0")


class AlikeTable(unittest.TestCase):
    def test_hidden_damage_is_counted_apart(self):
        rows = [flight(2.0, "1 2"), flight(2.0, ""), flight(0.1, "1 2 3"), flight(0.1, ""), flight(-0.5, "")]
        self.assertEqual(list(evidence_isolation.alike_table(rows, [], "abc")),
                         ["| 39 g | 5 | 0, 0 | 0 | 1 of 2 | 1 | 2.0 | 1 of 3 | 50.0 % | abc |"])

    def test_rows_of_other_columns_are_not_kept(self):
        kept = ["| 39 g | 5 | 0, 0 | 0 | 1 of 2 | 1 | 2.0 | 1 of 3 | 50.0 % | abc |"]
        self.assertEqual(list(evidence_isolation.alike_table([], kept, "def")), kept)
        with self.assertRaises(Failed):
            list(evidence_isolation.alike_table([], ["| 39 g | 5 | 0, 0 | 0 | 1 of 2 | 1 | 2.0 | 50.0 % | abc |"], "def"))


if __name__ == "__main__":
    unittest.main()
