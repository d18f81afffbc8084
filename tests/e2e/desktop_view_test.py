"""darm-view in a virtual display (Xvfb, Mesa's llvmpipe): its picture against the reference, and a server that goes."""
import json
import os
import signal
import subprocess
import time
import tomllib
import unittest
from pathlib import Path

from pictures import psnr, read_png
from running import BIN, SET_UP, Daemon, Folder, reference, wait_until

SIZE = "320x180"


def camera(name):
    with open(SET_UP, "rb") as file:
        found = next(c for c in tomllib.load(file)["cameras"] if c["name"] == name)
    vectors = [",".join(map(str, found[key])) for key in ("position", "target")]
    return f"{vectors[0]} {vectors[1]} {found['fovy']}"


class Display:
    """A screen in memory, as a context."""

    def __enter__(self):
        read, write = os.pipe()
        self.process = subprocess.Popen(
            ["Xvfb", "-displayfd", str(write), "-screen", "0", "1024x768x24", "-nolisten", "tcp"], pass_fds=[write],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(write)
        with os.fdopen(read) as pipe:
            self.name = ":" + pipe.readline().strip()
        self.views = []
        return self

    def __exit__(self, *_):
        for view in self.views:  # those of a test that failed
            view.kill()
            view.communicate()
        self.process.terminate()
        self.process.wait(timeout=20)

    def view(self, port, seconds, out, *more):
        """darm-view under way; `out`.png and `out`.json are there once it is done()."""
        self.views.append(subprocess.Popen(
            [BIN / "darm-view", f"127.0.0.1:{port}", "--camera", camera("hall"), "--size", SIZE, "--after", str(seconds),
             "--screenshot", f"{out}.png", "--report", f"{out}.json", *more],
            env={**os.environ, "DISPLAY": self.name}, stderr=subprocess.PIPE, text=True))
        return self.views[-1]


def done(view, out):
    """Its report."""
    _, error = view.communicate(timeout=120)
    if view.returncode != 0:
        raise AssertionError(f"darm-view: {view.returncode}: {error}")
    return json.loads(Path(f"{out}.json").read_text())


def kill_once_watched(daemon):
    """Kills the daemon some seconds after a viewer has come."""
    try:
        wait_until(lambda: "session 1: opened" in daemon.messages(), 20, "a session")
        time.sleep(6)
    finally:
        daemon.stop(signal.SIGKILL)


class DesktopView(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = Folder()
        cls.truth = reference(cls.folder.__enter__(), size=SIZE, spp=32, effects=None)
        cls.addClassCleanup(cls.folder.__exit__)

    def test_the_picture_is_the_references_with_opengl_es_and_desktop_opengl(self):
        with Folder() as folder, Display() as display:
            daemon = Daemon(Path(folder) / "state", q=64)
            try:
                outs = {kind: f"{folder}/{kind}" for kind in ("es", "desktop")}
                views = {kind: display.view(daemon.tcp, 35, out, "--gl", kind) for kind, out in outs.items()}
                for kind, out in outs.items():
                    report = done(views[kind], out)
                    dB = psnr(f"{out}.png", self.truth)
                    print(f"{kind}: {dB:.2f} dB, draw {report['draw_ms']}")
                    self.assertGreaterEqual(dB, 30.0)
                    self.assertEqual(report["joins"], 1)
                    self.assertGreater(report["stream_frames"], 0)
            finally:
                self.assertEqual(daemon.stop(), 0)

    def test_a_server_that_was_killed_is_found_again(self):
        with Folder() as folder, Display() as display:
            state, out = Path(folder) / "state", f"{folder}/resumed"
            daemon = Daemon(state, q=64)
            port = daemon.tcp
            view = display.view(port, 40, out)
            kill_once_watched(daemon)
            time.sleep(2)
            self.assertIsNone(view.poll(), "it outlives the server")
            daemon = Daemon(state, q=64, tcp_port=port)
            try:
                report = done(view, out)
                self.assertEqual(report["joins"], 2)
                self.assertGreaterEqual(psnr(f"{out}.png", self.truth), 30.0)
            finally:
                self.assertEqual(daemon.stop(), 0)

    def test_the_view_still_moves_when_the_server_is_gone(self):
        with Folder() as folder, Display() as display:
            out = f"{folder}/alone"
            daemon = Daemon(Path(folder) / "state")
            view = display.view(daemon.tcp, 18, out, "--turn", "20")
            kill_once_watched(daemon)
            report = done(view, out)
            self.assertEqual(report["joins"], 1)
            self.assertGreater(report["frames_drawn_alone"], 20)
            width, height, picture = read_png(f"{out}.png")
            self.assertEqual(f"{width}x{height}", SIZE)
            self.assertGreater(max(picture), 100, "it is not black")

    def test_who_has_seen_nothing_says_so_without_a_screenshot_too(self):
        with Display() as display:
            view = subprocess.run(
                [BIN / "darm-view", "127.0.0.1:1", "--size", SIZE, "--after", "2"],  # nobody listens there
                env={**os.environ, "DISPLAY": display.name}, stderr=subprocess.PIPE, text=True, timeout=60)
            self.assertEqual(view.returncode, 1)
            self.assertIn("no whole picture in 2 s", view.stderr)

    def test_tls_is_spoken_with_a_server_that_is_vouched_for(self):
        with Folder() as folder, Display() as display:
            state = Path(folder) / "state"
            daemon = Daemon(state)
            try:
                stranger = display.view(daemon.tcp, 4, f"{folder}/stranger", "--tls")
                _, error = stranger.communicate(timeout=60)
                self.assertEqual(stranger.returncode, 1)
                self.assertIn("certificate", error)
                known = f"{folder}/known"
                report = done(display.view(daemon.tcp, 10, known, "--tls", "--authority",
                                           str(state / "tls" / "certificate.pem")), known)
                self.assertEqual(report["joins"], 1)
                self.assertGreater(report["stream_frames"], 0)
            finally:
                self.assertEqual(daemon.stop(), 0)


if __name__ == "__main__":
    unittest.main(verbosity=2)
