"""What a running daemon shows at /metrics: told about, well formed, and enough for the dashboard and the alerts."""
import json
import re
import shutil
import subprocess
import unittest
from pathlib import Path

from running import SOURCE, Daemon, Folder, probe

PROMTOOL = shutil.which("promtool")
NAME = re.compile(r"\b(darm_\w+)")


def expressions():
    """All that the dashboard and the alert rules ask for."""
    dashboard = json.loads((SOURCE / "deploy/grafana/darmd.json").read_text())
    asked = [target["expr"] for panel in dashboard["panels"] for target in panel["targets"]]
    return asked + re.findall(r"^ *expr: (.*)$", (SOURCE / "deploy/prometheus/alerts.yml").read_text(), re.MULTILINE)


class Metrics(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        with Folder() as folder:
            daemon = Daemon(Path(folder) / "state")
            try:
                probe(daemon.tcp, Path(folder) / "picture.png", "--seconds", "4")
                cls.text = daemon.scrape()
            finally:
                daemon.stop()

    def test_every_metric_is_told_about(self):
        told = dict(re.findall(r"^# HELP (\w+) ?(.*)$", self.text, re.MULTILINE))
        kinds = dict(re.findall(r"^# TYPE (\w+) (\w+)$", self.text, re.MULTILINE))
        self.assertGreater(len(kinds), 30)
        self.assertEqual([name for name in kinds if name.startswith("darm_") and not told.get(name)], [])

    def test_dashboard_and_alerts_ask_for_what_is_there(self):
        # Counters of what went wrong come into being with the first time; their names are held by check_metrics.
        live = set(re.findall(r"^(\w+)[{ ]", self.text, re.MULTILINE))
        asked = {name for expression in expressions() for name in NAME.findall(expression)}
        self.assertGreater(len(asked), 20)
        self.assertEqual(sorted(name for name in asked - live if not name.endswith("_total")), [])

    @unittest.skipUnless(PROMTOOL, "promtool is not installed")
    def test_promtool_has_nothing_to_say(self):
        done = subprocess.run([PROMTOOL, "check", "metrics"], input=self.text, capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stdout + done.stderr), (0, ""))
        for what, name in (("config", "prometheus.yml"), ("rules", "alerts.yml")):
            done = subprocess.run([PROMTOOL, "check", what, SOURCE / "deploy/prometheus" / name], capture_output=True,
                                  text=True)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
