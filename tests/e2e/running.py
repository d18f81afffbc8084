"""Starts the real daemon and the real client for end-to-end tests."""
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.request
from pathlib import Path

BIN = Path(os.environ["DARM_BIN"])
SOURCE = Path(os.environ["DARM_SOURCE"])
SCENES = Path(os.environ["DARM_SHARED_SCENES"])
SET_UP = SOURCE / "config/scenes/default.toml"
sys.path.insert(0, str(SOURCE / "tests/support"))


class Daemon:
    """darmd serve on the default scene, at a low density so that a test takes seconds; `more` may say otherwise."""

    def __init__(self, state_dir, *more, set_up=SET_UP, q=16, tcp_port=0):
        self.log = tempfile.TemporaryFile("w+")
        self.process = subprocess.Popen(
            [BIN / "darmd", "serve", "--config", set_up, "--state-dir", state_dir, "--q", str(q), "--address",
             "127.0.0.1", "--tcp-port", str(tcp_port), "--udp-port", "0", "--metrics-port", "0", "--http-port", "0",
             "--allow-lossless", *more],
            stdout=subprocess.PIPE, stderr=self.log, text=True)
        self.ready = self.process.stdout.readline()
        found = re.search(r"ready: tcp 127\.0\.0\.1:(\d+), udp port (\d+), metrics http://127\.0\.0\.1:(\d+)", self.ready)
        if not found:
            self.process.kill()
            raise AssertionError("no ready line but: " + self.ready + self.messages())
        self.tcp, self.udp, self.metrics = map(int, found.groups())

    def messages(self):
        self.log.seek(0)
        return self.log.read()

    def scrape(self):
        """The text at /metrics."""
        with urllib.request.urlopen(f"http://127.0.0.1:{self.metrics}/metrics", timeout=5) as page:
            return page.read().decode()

    def values(self):
        """The metrics there, by name and labels."""
        lines = [line.split() for line in self.scrape().splitlines() if not line.startswith("#")]
        return {line[0]: float(line[1]) for line in lines if len(line) == 2}

    def stop(self, number=signal.SIGTERM):
        self.process.send_signal(number)
        code = self.process.wait(timeout=20)
        self.process.stdout.close()
        self.log.close()
        return code


def probe(port, out, *more, check=True, camera="hall", size="320x180", set_up=SET_UP):
    """Runs darm-probe to its end; its report as a dict."""
    done = subprocess.run(
        [BIN / "darm-probe", "--server", f"127.0.0.1:{port}", "--setup", set_up, "--camera", camera, "--size", size,
         "--out", out, "--json", *more], capture_output=True, text=True, timeout=120)
    if check and done.returncode != 0:
        raise AssertionError("darm-probe: " + done.stderr + done.stdout)
    return json.loads(done.stdout) if done.returncode == 0 else done.stderr


def start_probe(port, camera, out, seconds, *more, size="320x180", set_up=SET_UP):
    """A darm-probe that goes on beside the test; its report will be on its standard output."""
    return subprocess.Popen(
        [BIN / "darm-probe", "--server", f"127.0.0.1:{port}", "--setup", set_up, "--camera", camera, "--size", size,
         "--seconds", str(seconds), "--out", out, "--json", *more], stdout=subprocess.PIPE, text=True)


def reference(folder, camera="hall", size="320x180", spp=32, effects="view-independent", name="reference"):
    """A small reference, rendered in a second or two by darmd itself. `effects` None: all of them."""
    out = Path(folder) / f"{name}.png"
    only = ["--effects", effects] if effects else []
    done = subprocess.run(
        [BIN / "darmd", "render", "--config", SET_UP, "--camera", camera, "--size", size, "--spp", str(spp), *only,
         "--state-dir", folder, "--out", out, "--json"], capture_output=True, text=True, timeout=120)
    if done.returncode != 0:
        raise AssertionError("darmd render: " + done.stderr)
    return out.with_suffix(".pfm")


def wait_until(condition, seconds, what):
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            raise AssertionError("in %g s not: %s" % (seconds, what))
        time.sleep(0.1)


class Folder:
    """A temporary folder as a context."""

    def __enter__(self):
        self.path = tempfile.mkdtemp(prefix="darm-e2e-")
        return self.path

    def __exit__(self, *_):
        shutil.rmtree(self.path, ignore_errors=True)


class WithDaemon(unittest.TestCase):
    """One daemon and one temporary folder (`path`) for all tests of a class."""

    q = 16

    @classmethod
    def setUpClass(cls):
        cls.folder = Folder()
        cls.path = Path(cls.folder.__enter__())
        cls.daemon = Daemon(cls.path / "state", q=cls.q)

    @classmethod
    def tearDownClass(cls):
        code = cls.daemon.stop()
        cls.folder.__exit__()
        if code != 0:
            raise AssertionError(f"the daemon stopped with {code}")
