"""Every broken file ends in one clear line within 5 s and 1 GB; every good one loads."""
import os
import subprocess
import sys
import tempfile
import time
import unittest

from running import BIN, SCENES


def inspect(path):
    """(exit code, standard error, seconds, peak bytes) of darmd inspect."""
    start = time.monotonic()
    with tempfile.TemporaryFile("w+") as errors:
        child = subprocess.Popen([BIN / "darmd", "inspect", path, "--q", "1"], stdout=subprocess.DEVNULL, stderr=errors)
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        errors.seek(0)
        return child.returncode, errors.read().strip(), time.monotonic() - start, usage.ru_maxrss * 1024


@unittest.skipUnless(SCENES.is_dir(), f"the shared scenes are not at {SCENES}")
class HostileFiles(unittest.TestCase):
    def test_each_ends_in_one_clear_line(self):
        files = sorted(p for p in (SCENES / "invalid").rglob("*") if p.suffix in (".gltf", ".glb"))
        self.assertGreater(len(files), 5)
        for path in files:
            with self.subTest(file=path.name):
                code, message, seconds, peak = inspect(path)
                print(f"{path.relative_to(SCENES / 'invalid')} | {message} | {seconds:.2f} s | {peak / 1e6:.0f} MB",
                      file=sys.stderr)
                self.assertEqual(code, 1)
                self.assertEqual(len(message.splitlines()), 1, message)
                self.assertIn(path.name, message)
                self.assertLess(seconds, 5)
                self.assertLess(peak, 1e9)

    def test_small_feature_files_pass(self):
        for path in sorted((SCENES / "features").glob("*.glb")):
            if path.stat().st_size > 100_000:
                continue
            with self.subTest(file=path.name):
                code, message, _, _ = inspect(path)
                self.assertEqual(code, 0, message)


if __name__ == "__main__":
    unittest.main(verbosity=2)
