#!/usr/bin/env python3
"""Whether the checks of hostile cases find what they are for: programs that misbehave in one way each."""

import os
import stat
import tempfile
import unittest
from unittest import mock

import limits
from corpus.case import Case
from run import carry_out


# So that the tests need not wait as long as the cases do.
@mock.patch.object(limits, "SECONDS", 1.5)
@mock.patch.object(limits, "STOP_SECONDS", 2.5)
class Misbehaving(unittest.TestCase):
    def faults(self, script: str, stop_after: float | None = None, **case) -> str:
        """What is found wrong with a program that a shell script stands for."""
        with tempfile.TemporaryDirectory() as within:
            program = os.path.join(within, "program")
            with open(program, "w", encoding="utf-8") as file:
                file.write("#!/bin/sh\n" + script)
            os.chmod(program, stat.S_IRWXU)
            given = {"code": 3, "says": "^error: scene.toml:1:1: ", "files": {"scene.toml": "bansho = 2\n"}, **case}
            return "; ".join(carry_out(Case("kind", "name", ["check", "scene.toml"], **given), program, within, stop_after).faults)

    def test_a_good_program_has_no_faults(self):
        self.assertEqual(self.faults("echo 'error: scene.toml:1:1: is wrong' >&2; exit 3"), "")
        self.assertEqual(self.faults("exit 0", code=0), "")

    def test_exit_codes(self):
        self.assertIn("exit code 1, not 3", self.faults("echo 'error: scene.toml:1:1: is wrong' >&2; exit 1"))
        self.assertIn("signal 6", self.faults("kill -ABRT $$"))

    def test_errors_are_counted_and_have_a_place(self):
        self.assertIn("0 errors, not 1", self.faults("exit 3"))
        self.assertIn("2 errors, not 1", self.faults("for i in 1 2; do echo 'error: scene.toml:1:1: x' >&2; done; exit 3"))
        self.assertIn("says 'error: elsewhere'", self.faults("echo 'error: elsewhere' >&2; exit 3"))
        many = "for i in $(seq 100); do echo 'error: scene.toml:1:1: x' >&2; done; "
        self.assertIn("that there are 5 more", self.faults(many + "exit 3", errors=105))
        self.assertEqual(self.faults(many + "echo 'and 5 more' >&2; exit 3", errors=105), "")

    def test_what_is_written_to_stderr(self):
        self.assertIn("panics", self.faults("echo \"thread 'main' panicked at\" >&2; exit 101"))
        self.assertIn("control character", self.faults("printf 'error: scene.toml:1:1: \\033[2J\\n' >&2; exit 3"))
        self.assertIn("bytes to stderr", self.faults("head -c 1000000 /dev/zero | tr '\\0' a >&2; exit 3"))

    def test_files(self):
        error = "echo 'error: scene.toml:1:1: is wrong' >&2; exit 3"
        self.assertIn("leaves 'a.png'", self.faults("echo > a.png; " + error))
        self.assertIn("leaves '.a.png.1.part'", self.faults("echo > .a.png.1.part", code=0))
        self.assertIn("'a.png' half-written", self.faults("echo > a.png", code=0))
        self.assertIn("'scene.toml' is changed", self.faults("echo >> scene.toml; " + error))
        self.assertIn("'scene.toml' is removed", self.faults("rm scene.toml; " + error))

    def test_limits(self):
        self.assertIn("within 10 s", self.faults("exec sleep 60"))
        self.assertIn("exit code", self.faults("exec python3 -c 'bytearray(3 << 30)'", code=0))
        self.assertIn("leaves a process", self.faults("sleep 60 & exit 0", code=0))

    def test_stopping(self):
        self.assertEqual(self.faults("exec sleep 60", 0.1), "")
        self.assertIn("SIGTERM is ignored", self.faults("trap '' TERM; while true; do sleep 0.1; done", 0.1))
        self.assertIn("stops only", self.faults("trap 'sleep 2; exit 143' TERM; while true; do sleep 0.1; done", 0.2))
        self.assertIn("leaves '.a.part'", self.faults("echo > .a.part; exec sleep 60", 0.3))


if __name__ == "__main__":
    unittest.main()
