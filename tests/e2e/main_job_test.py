"""A client at the other end of a socket shows the picture of the path tracer."""
import subprocess
import unittest

from running import BIN, SET_UP, WithDaemon, probe, reference, wait_until

KEYS = ["psnr", "mssim", "ceiling_psnr", "ceiling_mssim", "reference_psnr", "seconds_to_first_image",
        "bytes_to_first_image", "coarser_fraction", "coarse_fraction", "frames", "no_changes", "latency_ms", "series"]


class MainJob(WithDaemon):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.reference = reference(cls.path)
        cls.out = cls.path / "picture.png"

    def test_the_picture_matches_the_reference_and_the_report_holds_its_keys(self):
        report = probe(self.daemon.tcp, self.out, "--seconds", "8", "--reference", self.reference,
                       "--view-phystex", "0",  # the reference is of light for every eye
                       "--ceiling-seconds", "4", "--ceiling-phystex", "4096")
        for key in KEYS:
            self.assertIn(key, report)
        for point in report["series"]:
            self.assertLessEqual({"t", "psnr", "error", "resolution_error", "omitted_error"}, point.keys())
        self.assertGreater(report["psnr"], 25.0)
        self.assertGreater(report["psnr"], report["ceiling_psnr"] - 3.0)
        self.assertLess(report["coarse_fraction"], 0.05)
        self.assertGreater(report["frames"], 0)
        self.assertTrue(self.out.exists())

    def test_a_second_client_gets_its_own_view_at_the_same_time(self):
        first = subprocess.Popen(
            [BIN / "darm-probe", "--server", f"127.0.0.1:{self.daemon.tcp}", "--setup", SET_UP, "--camera", "mirror",
             "--size", "160x90", "--seconds", "4", "--out", str(self.out) + ".mirror.png", "--json"],
            stdout=subprocess.PIPE, text=True)
        second = probe(self.daemon.tcp, self.out, "--seconds", "4", camera="windows", size="160x90")
        first.communicate(timeout=60)
        self.assertEqual(first.returncode, 0)
        self.assertGreater(second["frames"], 0)
        self.assertEqual(second["frames_lost"], 0)

    def test_a_client_may_ask_for_its_own_error_and_its_estimate_is_measured(self):
        rough = probe(self.daemon.tcp, self.out, "--seconds", "30", "--until-error", "0.05", "--target-error", "0.05",
                      camera="windows", size="160x90")
        self.assertAlmostEqual(rough["target_error"], 0.05, places=6)
        self.assertLessEqual(rough["error"], 0.05)
        plain = probe(self.daemon.tcp, self.out, "--seconds", "1", camera="windows", size="160x90")
        self.assertAlmostEqual(plain["target_error"], 0.002, places=6)
        self.assertGreater(self.daemon.values()["darm_view_error_count"], 0)
        self.assertIn("darm_views_on_target", self.daemon.values())

    def test_tls_is_spoken_with_a_server_that_is_vouched_for(self):
        with self.assertRaisesRegex(AssertionError, "certificate"):
            probe(self.daemon.tcp, self.out, "--seconds", "1", "--tls", size="160x90")
        known = probe(self.daemon.tcp, self.out, "--seconds", "2", "--authority",
                      self.out.parent / "state" / "tls" / "certificate.pem", size="160x90")
        self.assertGreater(known["frames"], 0)

    def test_a_client_that_vanishes_leaves_nothing_behind(self):
        client = subprocess.Popen(
            [BIN / "darm-probe", "--server", f"127.0.0.1:{self.daemon.tcp}", "--camera", "0,1.7,0 1,1.7,0 60", "--size",
             "160x90", "--seconds", "60", "--out", str(self.out) + ".gone.png"], stdout=subprocess.DEVNULL)
        wait_until(lambda: "session" in self.daemon.messages() and "opened" in self.daemon.messages(), 20, "opened")
        client.kill()
        client.wait()
        opened = lambda: self.daemon.messages().count(": opened")
        closed = lambda: self.daemon.messages().count(": closed")
        wait_until(lambda: opened() > 0 and opened() == closed(), 20, "every opened session closed")
        for kind in ("session", "encoder"):
            wait_until(lambda: self.daemon.values()['darm_actors{actor="%s"}' % kind] == 0, 20, f"every {kind} gone")

    def test_a_stranger_hears_one_clear_error(self):
        error = probe(1, self.out, "--seconds", "1", check=False)
        self.assertEqual(len(error.strip().splitlines()), 1)
        self.assertIn("127.0.0.1:1", error)


if __name__ == "__main__":
    unittest.main(verbosity=2)
