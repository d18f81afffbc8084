"""The time from a camera to the picture drawn for it is told by stage, and the stages make up the whole."""
import unittest

from running import SOURCE, WithDaemon, probe, wait_until

from slow_link import SlowLink

# What a stage may be under nothing, ms: clocks are read one after another, and the two ways of a ping differ.
SLACK = 2.0


class Lag(WithDaemon):
    q = 32

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.out = cls.path / "picture.png"
        cls.walk = SOURCE / "config/walkthroughs/default.json"
        # Where there is no light yet few cameras are answered by a picture: 6 to 16 on such a walk, then about 40.
        probe(cls.daemon.tcp, cls.out, "--walkthrough", cls.walk, "--seconds", "8", size="320x180")

    def lag(self, port, *more):
        # In a stream that somebody has walked through already, everything is there and no camera needs a picture.
        wait_until(lambda: self.daemon.values().get("darm_streams", 0) == 0, 10, "the last stream ended")
        report = probe(port, self.out, "--walkthrough", self.walk, "--seconds", "8", "--lag", *more, size="320x180")
        lag = report["lag_ms"]
        print({name: round(stage["mean"], 2) for name, stage in lag["stages"].items()}, "of", round(lag["mean"], 2))
        self.assertGreater(lag["samples"], 5)
        self.assertLess(abs(lag["sum_over_whole"] - 1), 0.05)
        self.assertLessEqual(lag["p50"], lag["p99"])
        for name, stage in lag["stages"].items():
            self.assertGreater(stage["mean"], -SLACK, name)
            self.assertLess(stage["mean"], lag["mean"] + SLACK, name)
        for name in ("visibility", "encode", "decode", "display"):
            self.assertGreater(lag["stages"][name]["mean"], 0, name)
        return lag

    def test_stages_add_up_to_the_whole(self):
        self.lag(self.daemon.tcp)

    def test_a_slow_line_is_found_where_it_is(self):
        link = SlowLink(self.daemon.tcp, mbit=20, rtt_ms=200)
        lag = self.lag(link.port, "--no-udp")
        link.stop()
        for name in ("network_up", "network_down"):
            self.assertGreater(lag["stages"][name]["p50"], 60, name)
        self.assertGreater(lag["p50"], 200)

    def test_without_being_asked_nothing_is_told(self):
        self.assertIsNone(probe(self.daemon.tcp, self.out, "--seconds", "2", size="160x90")["lag_ms"])


if __name__ == "__main__":
    unittest.main(verbosity=2)
