"""darmd render: the file of its sums saves time where it can and never costs the picture."""
import subprocess
import unittest
from pathlib import Path

from running import BIN, SET_UP, Folder

NAMED = '[[cameras]]\nname = "mine"\nposition = [0.0, 1.7, 0.0]\ntarget = [%g, 1.7, 0.0]\nfovy = 60\n'


class Render(unittest.TestCase):
    def setUp(self):
        folder = Folder()
        self.folder = Path(folder.__enter__())
        self.addCleanup(folder.__exit__)
        self.state = self.folder / "state"
        self.out = self.folder / "picture.png"

    def render(self, *more, state=None):
        """Standard error of a run that must succeed and write the picture."""
        self.out.unlink(missing_ok=True)
        done = subprocess.run(
            [BIN / "darmd", "render", "--config", SET_UP, "--size", "32x18", "--spp", "2", "--state-dir",
             state or self.state, "--out", self.out, "--json", *more], capture_output=True, text=True, timeout=60)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue(self.out.exists())
        return done.stderr

    def test_a_named_camera_may_be_moved_and_the_exposure_changed_a_little(self):
        setup = self.folder / "mine.toml"
        pictures = []
        for x in (1, -1):
            setup.write_text(NAMED % x)
            self.assertEqual(self.render("--config", setup, "--camera", "mine"), "")
            pictures.append(self.out.read_bytes())
        self.assertNotEqual(*pictures)
        for exposure in ("1e-9", "2e-9"):  # alike in six decimals
            self.assertEqual(self.render("--config", setup, "--camera", "mine", "--exposure", exposure), "")

    def test_a_folder_that_takes_no_file_is_a_warning(self):
        blocked = self.folder / "blocked"
        blocked.write_text("no folder")
        said = self.render("--camera", "hall", state=blocked)
        self.assertEqual(len(said.splitlines()), 1, said)
        self.assertIn("warning", said)

    def test_a_damaged_file_is_a_warning_and_written_anew(self):
        self.render("--camera", "hall")
        first = self.out.read_bytes()
        file, = self.state.glob("reference-*")
        file.write_bytes(file.read_bytes()[:-7])
        said = self.render("--camera", "hall")
        self.assertEqual(len(said.splitlines()), 1, said)
        self.assertIn(file.name, said)
        self.assertEqual(self.out.read_bytes(), first)
        self.assertEqual(self.render("--camera", "hall"), "")
        self.assertEqual([p.name for p in self.state.glob("*.part")], [])


if __name__ == "__main__":
    unittest.main(verbosity=2)
