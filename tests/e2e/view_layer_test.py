"""Two clients before one mirror see each their own reflection; where nothing reflects, nothing of this runs."""
import json
import struct
import unittest
from pathlib import Path

from running import Daemon, Folder, probe, reference, start_probe

# The default scene's mirror and copper ball, from two sides.
ANN, BOB = "-3,1.6,-1.6 -6,1.6,0.1 45", "-3,1.9,1.4 -6,1.5,-0.1 45"
SIZE = "160x90"


def matte_room(path):
    """Two quads under a lamp, ior 1: light that nobody's eye changes."""
    corners = [(-2, 0, 2), (2, 0, 2), (2, 0, -2), (-2, 0, -2), (-2, 0, -2), (2, 0, -2), (2, 3, -2), (-2, 3, -2)]
    binary = b"".join(struct.pack("<3f", *c) for c in corners)
    binary += struct.pack("<12H", 0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7)
    doc = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
           "nodes": [{"mesh": 0}, {"translation": [0, 2, 0], "extensions": {"KHR_lights_punctual": {"light": 0}}}],
           "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
           "materials": [{"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 1},
                          "extensions": {"KHR_materials_ior": {"ior": 1.0}}}],
           "accessors": [{"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3", "min": [-2, 0, -2],
                          "max": [2, 3, 2]}, {"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"}],
           "bufferViews": [{"buffer": 0, "byteLength": 96}, {"buffer": 0, "byteOffset": 96, "byteLength": 24}],
           "buffers": [{"byteLength": len(binary)}],
           "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_ior"],
           "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 20}]}}}
    text = json.dumps(doc).encode()
    text += b" " * (-len(text) % 4)
    path.write_bytes(struct.pack("<III", 0x46546C67, 2, 28 + len(text) + len(binary)) +
                     struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(binary), 0x004E4942) + binary)
    return path


class ViewLayer(unittest.TestCase):
    def test_two_clients_see_each_their_own_reflection(self):
        with Folder() as path:
            references = [reference(path, camera=c, size=SIZE, spp=64, effects=None, name=n)
                          for c, n in ((ANN, "ann"), (BOB, "bob"))]
            daemon = Daemon(Path(path) / "state")
            try:
                clients = [start_probe(daemon.tcp, c, f"{path}/{i}.png", 15, "--reference", str(r), size=SIZE)
                           for i, (c, r) in enumerate(zip((ANN, BOB), references))]
                reports = [json.loads(c.communicate(timeout=90)[0]) for c in clients]
                for report in reports:
                    self.assertGreater(report["psnr"], 24.0)  # q is a quarter of the set-up's, and the time short
                    self.assertGreater(report["view_slots_used"], 0)
                    self.assertGreater(report["view_frames"], 0)
                    self.assertGreater(report["view_bytes"], 0)
                    self.assertEqual(report["view_frames_lost"], 0)
                # Without its private layer the same picture is further from the truth by far.
                without = probe(daemon.tcp, f"{path}/without.png", "--seconds", "5", "--reference", references[0],
                                "--view-phystex", "0", camera=ANN, size=SIZE)
                self.assertEqual(without["view_phystex_size"], 0)
                self.assertLess(without["psnr"], reports[0]["psnr"] - 3.0)
                self.assertGreater(daemon.values()["darm_view_samples_total"], 0)
            finally:
                self.assertEqual(daemon.stop(), 0)

    def test_a_scene_whose_light_is_the_same_for_every_eye_runs_none_of_it(self):
        with Folder() as path:
            daemon = Daemon(Path(path) / "state", "--scene", matte_room(Path(path) / "matte.glb"))
            try:
                report = probe(daemon.tcp, f"{path}/out.png", "--seconds", "3", camera="0,1.5,4 0,1,0 50", size=SIZE)
                self.assertGreater(report["frames"], 0)
                self.assertEqual(report["view_phystex_size"], 0)
                self.assertEqual(report["view_bytes"], 0)
                shown = daemon.values()
                for name in ("samples", "frames", "bytes", "pictures"):
                    self.assertNotIn(f"darm_view_{name}_total", shown)
                self.assertFalse([n for n in shown if n.startswith("darm_actors") and "view" in n], shown)
            finally:
                self.assertEqual(daemon.stop(), 0)


if __name__ == "__main__":
    unittest.main(verbosity=2)
