"""kill -9 while light is computed, then a restart: the store is taken up, and the picture is there at once."""
import re
import signal
import unittest
from pathlib import Path

from running import Daemon, Folder, probe, reference


class Restart(unittest.TestCase):
    def test_the_first_picture_after_a_kill_is_the_last_before(self):
        with Folder() as folder:
            truth = reference(folder)
            state = Path(folder) / "state"
            daemon = Daemon(state)
            before = probe(daemon.tcp, Path(folder) / "before.png", "--seconds", "8", "--reference", truth,
                           "--view-phystex", "0")
            daemon.stop(signal.SIGKILL)
            daemon = Daemon(state)
            tiles = int(re.search(r"radiance store: (\d+) tiles", daemon.messages()).group(1))
            after = probe(daemon.tcp, Path(folder) / "after.png", "--seconds", "3", "--reference", truth,
                          "--view-phystex", "0")
            self.assertEqual(daemon.stop(), 0)
            self.assertGreater(tiles, 50)
            self.assertGreater(after["series"][0]["psnr"], before["psnr"] - 0.5)

    def test_traced_light_is_not_taken_from_stored_light(self):
        with Folder() as folder:
            state = Path(folder) / "state"
            daemon = Daemon(state)
            probe(daemon.tcp, Path(folder) / "lit.png", "--seconds", "2")
            self.assertEqual(daemon.stop(), 0)
            preset = Path(folder) / "reference.toml"
            preset.write_text('[accuracy]\npreset = "reference"\n')
            daemon = Daemon(state, "--config", preset)
            tiles = int(re.search(r"radiance store: (\d+) tiles", daemon.messages()).group(1))
            self.assertEqual(daemon.stop(), 0)
            self.assertEqual(tiles, 0)


if __name__ == "__main__":
    unittest.main(verbosity=2)
