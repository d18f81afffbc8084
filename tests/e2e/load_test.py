"""darm-load against the real daemon: every kind of client, no fault in what is sent, and the report's keys."""
import json
import subprocess
import unittest

from running import BIN, SET_UP, SOURCE, Daemon, WithDaemon

WALK = SOURCE / "config/walkthroughs/default.json"
KEYS = ("clients connected updates_per_second stream_frames_per_second no_changes_per_second integrity_faults "
        "integrity_faults_by_kind answer_ms server_cpu_seconds_per_second harness_cpu_seconds_per_second "
        "server_rss_bytes bytes_per_client_per_second key_frames frames_dropped disconnects").split()


class Load(WithDaemon):
    def load(self, *more, port=None):
        return subprocess.run(
            [BIN / "darm-load", f"127.0.0.1:{port or self.daemon.tcp}", "--width", "320", "--height", "180", *more],
            capture_output=True, text=True, timeout=200)

    def report(self, *more):
        done = self.load("--setup", SET_UP, "--groups", "--walkthrough", WALK, "--json", *more)
        self.assertEqual(done.returncode, 0, done.stderr + done.stdout)
        return json.loads(done.stdout)

    def test_every_kind_of_client_is_served_without_a_fault(self):
        plot = self.path / "plot.svg"
        report = self.report("--clients", "8", "--seconds", "6", "--decode", "1", "--draw", "1", "--slow", "1",
                             "--slow-rate", "20000", "--vanish", "2", "--teleport", "1", "--churn", "0.5",
                             "--server-pid", str(self.daemon.process.pid), "--plot", plot)
        for key in KEYS:
            self.assertIn(key, report)
        joins = report["joins"]
        self.assertGreaterEqual(joins, 2)
        self.assertEqual(report["clients"], 8 + joins)
        self.assertEqual(report["connected"], report["clients"])
        self.assertEqual(report["integrity_faults"], 0, report["integrity_faults_by_kind"])
        self.assertTrue(report["all_ready"])
        self.assertEqual(report["healthy"]["clients"], 4 + joins)
        self.assertEqual([report[role]["clients"] for role in ("slow", "vanishing", "teleporting")], [1, 2, 1])
        self.assertGreater(report["updates_per_second"]["p50"], 0)
        self.assertGreater(report["answer_ms"]["p99"], 0)
        self.assertLessEqual(report["answer_ms"]["p50"], report["answer_ms"]["p99"])
        self.assertGreater(report["server_cpu_seconds_per_second"], 0)
        self.assertGreater(report["server_rss_bytes"]["max"], 1 << 20)
        self.assertEqual(report["disconnects"], {"left": joins, "vanished": 2})
        self.assertGreater(report["pictures"]["decoded"], 0)
        self.assertGreater(report["pictures"]["drawn"], 0)
        self.assertEqual(report["pictures"]["refused"], 0)
        self.assertIn("<path", plot.read_text())

    def test_a_far_and_lossy_line_delays_answers_and_spoils_nothing(self):
        report = self.report("--clients", "2", "--seconds", "4", "--delay-ms", "200", "--loss", "0.02", "--rate-mbit",
                             "5", "--no-udp")
        self.assertEqual(report["integrity_faults"], 0, report["integrity_faults_by_kind"])
        self.assertEqual(report["connected"], 2)
        self.assertGreater(report["answer_ms"]["p50"], 200)

    def test_without_a_set_up_clients_look_from_the_servers_first_camera(self):
        done = self.load("--clients", "2", "--seconds", "2")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stdout, r"healthy +2 +2 ")

    def test_a_full_server_is_said_in_a_sentence(self):
        set_up = self.path / "full.toml"
        set_up.write_text(SET_UP.read_text().replace('"default.glb"', f'"{SET_UP.parent}/default.glb"')
                          .replace('"../walkthroughs', f'"{SET_UP.parent}/../walkthroughs') +
                          "\n[session]\nmax_sessions = 1\n")
        daemon = Daemon(self.path / "other", set_up=set_up)
        done = self.load("--clients", "2", "--seconds", "1", "--json", port=daemon.tcp)
        daemon.stop()
        self.assertEqual(done.returncode, 1)
        report = json.loads(done.stdout)
        self.assertEqual(report["connected"], 1)
        self.assertEqual(report["disconnects"], {"SERVER_FULL": 1})
        self.assertIn("max_sessions", done.stderr)

    def test_nobody_there_is_no_success(self):
        done = self.load("--clients", "1", "--seconds", "1", "--json", port=1)
        self.assertEqual(done.returncode, 1)
        self.assertEqual(json.loads(done.stdout)["disconnects"], {"connect_failed": 1})

    def test_what_cannot_be_is_refused_in_one_line(self):
        for arguments, word in ((["--clients", "1", "--slow", "2"], "--slow"),
                                (["--clients", "1", "--groups"], "--setup"),
                                (["--clients", "1", "--server-pid", "1073741823"], "--server-pid")):
            done = self.load(*arguments)
            self.assertEqual(done.returncode, 1)
            self.assertIn(word, done.stderr)
            self.assertEqual(done.stderr.count("\n"), 1)


if __name__ == "__main__":
    unittest.main(verbosity=2)
