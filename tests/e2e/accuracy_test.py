"""darmd accuracy: a small study of the default scene, resumed, changed and cut off."""
import csv
import json
import signal
import subprocess
import time
import unittest
import xml.etree.ElementTree as xml
from pathlib import Path

from running import BIN, SET_UP, Folder, wait_until


class Accuracy(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = Folder()
        cls.state = Path(folder.__enter__())  # layouts and reference are made once
        cls.addClassCleanup(folder.__exit__)

    def setUp(self):
        folder = Folder()
        self.folder = Path(folder.__enter__())
        self.addCleanup(folder.__exit__)
        self.out = self.folder / "out"

    def command(self, *more, cameras=("hall",), state=None, size="128x72", seconds="2"):
        return [BIN / "darmd", "accuracy", "--config", SET_UP, "--cameras", *cameras, "--size", size, "--q", "16",
                "--seconds", seconds, "--reference-psnr", "33", "--state-dir", state or self.state, "--out", self.out,
                *more]

    def study(self, *more):
        """A run that must succeed: (its report, what it said)."""
        done = subprocess.run(self.command(*more), capture_output=True, text=True, timeout=200)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads((self.out / "accuracy.json").read_text()), done.stdout

    def curves(self, report):
        return {m["variant"]: m["curve"] for m in report["measurements"]}

    def test_worse_knobs_give_worse_pictures_and_a_rerun_measures_nothing(self):
        chosen = ("--only", "balanced,camera frames,filter,q 8,codec,sky,all indirect light,all but 4 bounces")
        report, said = self.study(*chosen)
        self.assertIn("11 measured, 0 from before", said)
        last = {name: curve[-1]["db"] for name, curve in self.curves(report).items() if curve}
        self.assertGreater(last["balanced"], 25)  # the scene is recognised
        self.assertGreater(last["balanced"], last["no filter"] + 1)
        self.assertGreater(last["balanced"], last["q 8"] + 1)
        self.assertGreater(last["balanced"], self.curves(report)["balanced"][0]["db"] + 1)
        figures = {m["variant"]: m["figures"] for m in report["measurements"]}
        for finer, coarser in (("crf 14", "crf 18"), ("crf 18", "crf 23"), ("crf 23", "crf 28")):
            self.assertGreater(figures[finer]["first_codec_db"], figures[coarser]["first_codec_db"])
            self.assertGreater(figures[finer]["first_bytes"], figures[coarser]["first_bytes"])
        # The first picture is one of tiles, which the codec harms; what is coarse would be the same before and after it.
        self.assertLess(figures["crf 28"]["first_codec_db"], 55)
        self.assertGreater(figures["crf 14"]["first_bytes"], 4000)
        self.assertLess(figures["all indirect light"]["without_db"], figures["all but 4 bounces"]["without_db"])
        self.assertLess(figures["all indirect light"]["seconds_without"], figures["all indirect light"]["seconds_with"])
        self.check_files(report)
        before = (self.out / "results.jsonl").read_bytes()
        again, said = self.study(*chosen)
        self.assertIn("0 measured, 11 from before", said)
        self.assertEqual((self.out / "results.jsonl").read_bytes(), before)
        self.assertEqual(again["measurements"], report["measurements"])

    def check_files(self, report):
        xml.fromstring((self.out / "accuracy.html").read_text().removeprefix("<!DOCTYPE html>"))
        pictures = list(self.out.glob("pictures/*.svg"))
        self.assertGreater(len(pictures), 2)
        for picture in pictures:
            xml.parse(picture)
            self.assertIn(f"(pictures/{picture.name})", (self.out / "accuracy.md").read_text())
        with open(self.out / "curves.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(len(rows), sum(len(m["curve"]) for m in report["measurements"]))
        self.assertFalse((self.out / ".darmd-accuracy-run").exists())  # radiance stores are gone
        self.assertFalse((self.out / "frames.bin").exists())

    def test_a_changed_set_up_is_measured_anew(self):
        self.study("--only", "sky")
        darker = self.folder / "darker.toml"
        darker.write_text("[sky]\nzenith = 1.0\nhorizon = 1.0\nground = 0.5\n")
        report, said = self.study("--only", "sky", "--config", darker)
        self.assertIn("1 measured, 0 from before", said)
        self.assertEqual(len(report["measurements"]), 1)

    def test_an_interrupted_run_keeps_what_is_done_and_goes_on(self):
        running = subprocess.Popen(self.command("--only", "sky,balanced,filter"), stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE, text=True)
        results = self.out / "results.jsonl"
        wait_until(lambda: results.exists() and results.stat().st_size > 0, 100, "a first result")
        running.send_signal(signal.SIGINT)
        _, said = running.communicate(timeout=30)
        self.assertEqual(running.returncode, 130, said)
        self.assertIn("goes on where it stopped", said)
        self.assertFalse((self.out / ".darmd-accuracy-run").exists())
        done = len(results.read_text().splitlines())
        self.assertLess(done, 3)
        report, said = self.study("--only", "sky,balanced,filter")
        self.assertIn(f"{3 - done} measured, {done} from before", said)
        runs = {m["figures"]["run_began"] for m in report["measurements"]}
        self.assertEqual(len(runs), 2)
        self.assertIn("* Measured in another run", (self.out / "accuracy.html").read_text())

    def test_a_stop_waits_for_no_further_variant(self):
        running = subprocess.Popen(self.command("--only", "codec"), stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                   text=True)
        results = self.out / "results.jsonl"
        wait_until(lambda: results.exists() and results.stat().st_size > 0, 100, "a first result")
        running.send_signal(signal.SIGINT)
        _, said = running.communicate(timeout=60)
        self.assertEqual(running.returncode, 130, said)
        self.assertLess(len(results.read_text().splitlines()), 5, said)

    def test_one_wish_to_stop_that_is_sent_twice_is_one(self):
        # As timeout(1) sends it: to the process, and to its group.
        running = subprocess.Popen(self.command("--only", "balanced"), stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                   text=True)
        wait_until(self.out.exists, 100, "a folder")
        for _ in range(2):
            running.send_signal(signal.SIGINT)
            time.sleep(0.05)
        _, said = running.communicate(timeout=60)
        self.assertEqual(running.returncode, 130, said)
        self.assertIn("goes on where it stopped", said)

    def test_a_camera_that_sees_nothing_is_left_out_and_alone_refused(self):
        nowhere = "0,900,0 0,1000,0 60"
        done = subprocess.run(self.command("--only", "sky", cameras=[nowhere]), capture_output=True, text=True,
                              timeout=100)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
        self.assertIn(f"camera {nowhere} sees no opaque surface", done.stderr)
        self.assertFalse((self.out / "accuracy.json").exists())
        done = subprocess.run(self.command("--only", "sky", cameras=[nowhere, "hall"]), capture_output=True,
                              text=True, timeout=200)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn(f"warning: camera {nowhere} sees no opaque surface", done.stderr)
        report = json.loads((self.out / "accuracy.json").read_text())
        self.assertEqual([c["name"] for c in report["cameras"]], ["hall"])
        self.assertEqual({m["camera"] for m in report["measurements"]}, {"hall"})

    def test_a_study_that_measures_nothing_has_failed(self):
        # A full picture at 720p and this density takes three times the half second on two cores.
        command = self.command("--only", "reference", size="1280x720", seconds="0.5")
        command[command.index("33")] = "15"
        command[command.index("16")] = "64"
        done = subprocess.run(command, capture_output=True, text=True, timeout=200)
        if done.returncode == 0:
            self.skipTest("this machine makes a full picture in half a second")
        self.assertEqual(done.returncode, 1)
        last = done.stderr.splitlines()[-1]
        self.assertIn("nothing was measured", last)
        self.assertIn("--seconds", last)

    def test_a_report_that_cannot_be_written_is_refused_before_the_work(self):
        state = self.folder / "state"
        for blocked in (self.out, self.out / "pictures", self.out / "accuracy.html", self.out / "results.jsonl"):
            blocked.parent.mkdir(exist_ok=True)
            if blocked.suffix:
                blocked.mkdir()  # where a file is to be
            else:
                blocked.write_text("")  # where a folder is to be
            done = subprocess.run(self.command(state=state), capture_output=True, text=True, timeout=60)
            self.assertEqual(done.returncode, 1)
            self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
            self.assertIn(f"darmd accuracy: {blocked}: ", done.stderr)
            self.assertEqual(list(state.glob("*")), [])
            if blocked.suffix:
                blocked.rmdir()
            else:
                blocked.unlink()

    def test_what_cannot_be_done_is_one_clear_line(self):
        for more, words in ((("--only", "everything"), "groups are presets, q"), (("--cameras", "nowhere"), "nowhere")):
            done = subprocess.run(self.command(*more), capture_output=True, text=True, timeout=60)
            self.assertEqual(done.returncode, 1)
            self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
            self.assertIn(words, done.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
