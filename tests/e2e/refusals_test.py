"""What cannot be right is refused at once, in words that name it: before a scene is loaded or a server called."""
import base64
import json
import struct
import subprocess
import tempfile
import unittest
from pathlib import Path

from running import BIN, SET_UP, Daemon

SERVE = ["darmd", "serve"]
RENDER = ["darmd", "render", "--config", SET_UP, "--camera", "hall", "--out", "x.png"]
PROBE = ["darm-probe", "--server", "127.0.0.1:1"]
CAMERA = ["--camera", "0,1,0 1,1,0 60"]


def refusal(command, folder):
    done = subprocess.run([BIN / command[0], *command[1:]], capture_output=True, text=True, timeout=10, cwd=folder)
    return done.returncode, done.stdout + done.stderr


class Refusals(unittest.TestCase):
    def check(self, cases):
        with tempfile.TemporaryDirectory() as folder:
            for command, words in cases:
                with self.subTest(command=" ".join(map(str, command))):
                    code, said = refusal(command, folder)
                    self.assertNotEqual(code, 0)
                    self.assertIn(words, said)
            self.assertEqual(list(Path(folder).iterdir()), [])

    def test_commands_that_are_none(self):
        self.check([(["darmd", "bogus"], '"bogus": no such command; known are serve'),
                    (["darmd"], "no command; known are serve")])

    def test_numbers_that_are_none_or_out_of_range(self):
        self.check([
            (RENDER + ["--until-psnr", "nan"], "--until-psnr"),
            (RENDER + ["--spp", "2", "--exposure", "nan"], "--exposure"),
            (RENDER + ["--spp", "2", "--exposure", "1e-44"], "--exposure"),
            (RENDER + ["--spp", "2", "--q", "1e-320"], "--q"),
            (RENDER + ["--spp", "2", "--q", "inf"], "--q"),
            (PROBE + CAMERA + ["--seconds", "nan"], "--seconds"),
            (PROBE + CAMERA + ["--seconds", "-3"], "--seconds"),
            (PROBE + CAMERA + ["--updates-per-second", "nan"], "--updates-per-second"),
            (PROBE + CAMERA + ["--until-error", "nan"], "--until-error"),
            (PROBE + CAMERA + ["--size", "4294967297x10"], "--size"),
            (PROBE + CAMERA + ["--size", "10x-4294967290"], "--size"),
        ])

    def test_cameras(self):
        for more in ([], ["--setup", SET_UP]):
            self.check([
                (PROBE + ["--camera", "1e300,0,0 1,1,1 60", *more], "within 1e7"),
                (PROBE + ["--camera", "1e999,0,0 1,1,1 60", *more], "within 1e7"),
                (PROBE + ["--camera", "nan,0,0 1,1,1 60", *more], "finite"),
                (PROBE + ["--camera", "0,0,0 1,1,1 nan", *more], "field of view"),
            ])

    def test_addresses(self):
        self.check([(SERVE + ["--address", address], f'listen.address: "{address}" is not an IP address')
                    for address in ("nonsense", "localhost", "127.0.0.1:9010")])

    def test_places(self):
        self.check([
            (PROBE + CAMERA + ["--out", "missing/x.png"], "folder missing does not exist"),
            (SERVE + ["--state-dir", ""], "--state-dir"),
            (SERVE + ["--scene", ""], "--scene"),
            (SERVE + ["--config", SET_UP.parent], "is a directory"),
            (SERVE + ["--config", ""], "--config"),
            (SERVE + ["--http-port", "70000"], "--http-port"),
        ])


class LeftOut(unittest.TestCase):
    """What cannot be shown is named, and the rest is served."""

    def test_serve_names_the_triangles_it_leaves_out(self):
        with tempfile.TemporaryDirectory() as folder:
            corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (2, 2, 2), (2, 2, 2), (2, 2, 2)]
            data = b"".join(struct.pack("<3f", *c) for c in corners)
            scene = Path(folder) / "two.gltf"
            scene.write_text(json.dumps({
                "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
                "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
                "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 6,
                               "min": [0, 0, 0], "max": [2, 2, 2]}],
                "bufferViews": [{"buffer": 0, "byteLength": len(data)}],
                "buffers": [{"byteLength": len(data),
                             "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode()}]}))
            daemon = Daemon(Path(folder) / "state", "--scene", scene)
            self.addCleanup(daemon.process.kill)
            self.assertIn("two.gltf: 1 triangles are left out (1 zero area)", daemon.messages())
            self.assertEqual(daemon.stop(), 0)


if __name__ == "__main__":
    unittest.main(verbosity=2)
