#!/usr/bin/python3
"""Every `airworthy X` that the help, the pages or a program's own texts offer is a program of this project.

  commands_exist_test.py PROJECT
"""
import pathlib
import re
import sys
import unittest

PROJECT = pathlib.Path(sys.argv[1])
# Not programs of their own: cli/airworthy.cpp answers them.
BUILT_IN = {"help", "version", "X", "COMMAND"}


def programs():
    """Names from `airworthy_program(airworthy-NAME` of every CMakeLists.txt."""
    lists = [path for path in PROJECT.rglob("CMakeLists.txt") if "build" not in path.relative_to(PROJECT).parts]
    return {name for path in lists for name in re.findall(r"airworthy_program\(airworthy-([a-z0-9-]+)", path.read_text())}


class CommandsExist(unittest.TestCase):
    def test_the_list_of_the_help(self):
        source = (PROJECT / "cli/dispatch/commands.cpp").read_text()
        listed = re.findall(r'About\{"([a-z0-9-]+)",', source)
        self.assertIn("watch", listed)
        self.assertEqual(set(listed) - programs(), set())

    def test_what_pages_and_programs_offer(self):
        pages = [PROJECT / "README.md", *PROJECT.glob("docs/**/*.md"), *PROJECT.glob("config/**/*.toml"),
                 *PROJECT.glob("cli/**/*.cpp")]
        known = programs() | BUILT_IN
        offered = re.compile(r"""(?:^|[`'"(])airworthy ([A-Za-z][a-z0-9-]*)""", re.MULTILINE)
        found = {(str(page.relative_to(PROJECT)), word) for page in pages for word in offered.findall(page.read_text())}
        self.assertGreater(len(found), 20)
        self.assertEqual({(page, word) for page, word in found if word not in known}, set())


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
