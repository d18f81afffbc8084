"""A client is inside the scene after few bytes, and what it sees first lacks nothing."""
import unittest
from pathlib import Path

from running import SCENES, SET_UP, SOURCE, Daemon, Folder, probe

from slow_link import SlowLink

KINDS = ["manifest", "geometry", "coarse", "video", "page_table", "protocol"]
SPONZA = SCENES / "scenes/sponza.glb"


class FirstPicture(unittest.TestCase):
    def look(self, bound, *scene, q=16, set_up=SET_UP, camera="hall"):
        """A first visit, and one after it in which the light is there already."""
        with Folder() as path:
            daemon = Daemon(Path(path) / "state", *scene, q=q, set_up=set_up)
            try:
                link = SlowLink(daemon.tcp, mbit=20, rtt_ms=40)
                for visit in ("cold", "warm"):
                    report = probe(link.port, Path(path) / "picture.png", "--seconds", "6", "--no-udp",
                                   "--check-first-picture", size="320x180", set_up=set_up, camera=camera)
                    self.check(report, bound, visit)
                link.stop()
            finally:
                self.assertEqual(daemon.stop(), 0)

    def check(self, report, bound, visit):
        for name in ("first_picture", "first_image"):
            bytes_ = report[name]["bytes"]
            with self.subTest(visit=visit, picture=name, bytes=bytes_):
                self.assertEqual(sum(bytes_[kind] for kind in KINDS), bytes_["total"])
                self.assertGreater(bytes_["geometry"], 0)
                self.assertGreater(bytes_["coarse"], 0)
                self.assertLess(bytes_["total"], bound)
        # Where a surface is in the end, one was at first: what was in view had come.
        self.assertAlmostEqual(report["first_picture"]["background_fraction"], report["background_fraction"], delta=1e-4)
        self.assertGreaterEqual(report["chunks"], report["first_picture"]["chunks"])
        print(f"{visit}: first picture {report['first_picture']}, with the stream {report['first_image']}")

    def test_of_the_default_scene(self):
        self.look(400_000)

    @unittest.skipUnless(SPONZA.exists(), f"{SPONZA} is not here: the bound of Sponza's bytes is not held")
    def test_of_sponza_under_4_mb(self):
        self.look(4_000_000, "--scene", SPONZA, q=64, set_up=SOURCE / "config/scenes/sponza.toml", camera="atrium")


if __name__ == "__main__":
    unittest.main(verbosity=2)
