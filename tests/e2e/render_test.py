"""darmd render: the file of its sums saves time where it can and never costs the picture."""
import base64
import json
import re
import signal
import struct
import subprocess
import unittest
from pathlib import Path

from running import BIN, SET_UP, Folder, wait_until

NAMED = '[[cameras]]\nname = "mine"\nposition = [0.0, 1.7, 0.0]\ntarget = [%g, 1.7, 0.0]\nfovy = 60\n'


class Render(unittest.TestCase):
    def setUp(self):
        folder = Folder()
        self.folder = Path(folder.__enter__())
        self.addCleanup(folder.__exit__)
        self.state = self.folder / "state"
        self.out = self.folder / "picture.png"

    def render(self, *more, state=None, spp="2"):
        """Standard error of a run that must succeed and write the picture, but for what two samples lack: each says it."""
        self.out.unlink(missing_ok=True)
        done = subprocess.run(
            [BIN / "darmd", "render", "--config", SET_UP, "--size", "32x18", "--spp", spp, "--state-dir",
             state or self.state, "--out", self.out, "--json", *more], capture_output=True, text=True, timeout=60)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue(self.out.exists())
        return "".join(line for line in done.stderr.splitlines(True) if "cut at white" not in line)

    def test_what_few_samples_cut_at_white_is_told(self):
        done = subprocess.run(
            [BIN / "darmd", "render", "--config", SET_UP, "--size", "32x18", "--spp", "2", "--state-dir", self.state,
             "--out", self.out, "--json", "--camera", "hall"], capture_output=True, text=True, timeout=60)
        self.assertGreater(json.loads(done.stdout)["doubtful_cut"], 0.01)
        self.assertIn("% of the light is cut at white", done.stderr)

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

    def start(self, *more, state=None):
        """A run that would take minutes."""
        running = subprocess.Popen(
            [BIN / "darmd", "render", "--config", SET_UP, "--camera", "hall", "--size", "32x18", "--spp", "1000000",
             "--state-dir", state or self.state, "--out", self.out, *more], stderr=subprocess.PIPE, text=True)
        self.addCleanup(running.stderr.close)
        self.addCleanup(running.wait)
        self.addCleanup(running.kill)
        return running

    def test_an_interrupted_picture_is_kept_and_goes_on(self):
        running = self.start()
        wait_until(self.state.exists, 60, "a state folder")
        running.send_signal(signal.SIGINT)
        _, said = running.communicate(timeout=60)
        self.assertEqual(running.returncode, 130, said)
        file, = self.state.glob("reference-*")
        self.assertIn(f"are kept in {file}; the same command goes on from there", said)
        self.assertFalse(self.out.exists())
        spp = re.search(r"(\d+) samples per pixel", said).group(1)
        self.assertIn(f"with --spp {spp} it writes this picture", said)
        kept = file.read_bytes()
        self.render("--camera", "hall", spp=spp)
        self.assertEqual(file.read_bytes(), kept)  # the time spent too: nothing was traced again
        self.assertEqual(json.loads(self.out.with_suffix(".json").read_text())["spp"], int(spp))

    def test_what_cannot_be_kept_is_said_before_the_work_and_after_it(self):
        blocked = self.folder / "blocked"
        blocked.write_text("no folder")
        running = self.start("--json", state=blocked)
        first = running.stderr.readline()  # comes while it works
        self.assertIn(f"warning: {blocked}: ", first)
        running.send_signal(signal.SIGINT)
        _, said = running.communicate(timeout=60)
        self.assertEqual(running.returncode, 130, said)
        self.assertIn("could not be kept", said)

    def test_a_picture_that_cannot_be_written_is_refused_before_the_work(self):
        for name in ("picture.png", "picture.b.pfm", "picture.json"):
            blocked = self.folder / name
            blocked.mkdir()
            running = self.start()
            _, said = running.communicate(timeout=60)
            self.assertEqual(running.returncode, 1, said)
            self.assertEqual(said, f"darmd render: {blocked}: cannot be written: it is a folder; name a file\n")
            self.assertFalse(self.state.exists())
            blocked.rmdir()

    def test_a_light_that_cannot_shine_is_named(self):
        corners = base64.b64encode(struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)).decode()
        scene = self.folder / "dark.gltf"
        scene.write_text(json.dumps({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0, "extensions": {"KHR_lights_punctual": {"light": 0}}}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
            "buffers": [{"byteLength": 36, "uri": "data:application/octet-stream;base64," + corners}],
            "bufferViews": [{"buffer": 0, "byteLength": 36}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3}],
            "extensionsUsed": ["KHR_lights_punctual"],
            "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "name": "lamp", "intensity": -5}]}}}))
        said = self.render("--scene", scene, "--camera", "0.2,0.2,3 0.2,0.2,0 60")
        self.assertIn("warning: " + str(scene) + ": light 0 'lamp' has a negative intensity", said)

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
