"""Work stops where the error that was asked for is reached: an idle daemon before a still client."""
import time
import unittest
from pathlib import Path

from running import Daemon, Folder, start_probe

PATIENCE = 120


def samples(daemon):
    return daemon.values().get("darm_renderer_texel_samples_total", 0.0)


class Target(unittest.TestCase):
    def test_a_view_on_target_takes_no_more_samples(self):
        with Folder() as folder:
            set_up = Path(folder) / "target.toml"
            set_up.write_text("[accuracy]\ntarget = 1\n")
            daemon = Daemon(Path(folder) / "state", "--config", set_up, q=32)
            client = start_probe(daemon.tcp, "hall", Path(folder) / "picture.png", PATIENCE + 10, "--view-phystex",
                                 "0")
            try:
                end = time.monotonic() + PATIENCE
                before, calm = samples(daemon), 0
                while calm < 3 and time.monotonic() < end:  # the coarse level has its rounds first
                    time.sleep(1)
                    now = samples(daemon)
                    calm = calm + 1 if now == before and now > 0 else 0
                    before = now
                self.assertIsNone(client.poll(), "the client is there")
                self.assertEqual(calm, 3, f"still at work after {PATIENCE} s: {before} samples")
            finally:
                client.kill()
                client.wait()
                daemon.stop()


if __name__ == "__main__":
    unittest.main(verbosity=2)
