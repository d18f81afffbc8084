"""Clients that keep to the protocol's letter and ask for all they can: the others go on, and the daemon stops in time."""
import math
import re
import resource
import signal
import socket
import struct
import threading
import time
import unittest
from pathlib import Path

from running import SOURCE, Daemon, Folder, probe, wait_until

HELLO, CAMERA, GOODBYE, WELCOME = 1, 2, 4, 5
VERSION = int(re.search(r"kProtocolVersion = (\d+)", (SOURCE / "proto/limits.hpp").read_text()).group(1))


def varint(n):
    out = b""
    while n > 0x7F:
        out += bytes([n & 0x7F | 0x80])
        n >>= 7
    return out + bytes([n])


def field(number, value):
    """A protobuf field: int -> varint, float -> 32 bits, bytes -> length-delimited."""
    if isinstance(value, int):
        return varint(number << 3) + varint(value)
    if isinstance(value, float):
        return varint(number << 3 | 5) + struct.pack("<f", value)
    return varint(number << 3 | 2) + varint(len(value)) + value


def pose(angle, width, height):
    position = b"".join(varint(n << 3 | 1) + struct.pack("<d", x) for n, x in ((1, 0.0), (2, 1.7), (3, 0.0)))
    return (field(1, position) + field(2, math.cos(angle / 2)) + field(4, math.sin(angle / 2)) + field(6, 1.0) +
            field(7, width) + field(8, height))


class Client:
    """Reads and forgets what it is sent, once it has been let in."""

    def __init__(self, port):
        self.socket = socket.create_connection(("127.0.0.1", port))
        self.connected = True

    def enter(self):
        self.hello()
        return self.welcomed()

    def hello(self):
        self.send(HELLO, field(1, VERSION) + field(2, b"rude") + field(4, 2048))

    def welcomed(self):
        answer = self.socket.recv(5, socket.MSG_WAITALL)
        if len(answer) < 5 or answer[4] != WELCOME << 3 | 2:
            raise AssertionError("no welcome but " + repr(answer))
        threading.Thread(target=self.drain, daemon=True).start()
        return self

    def drain(self):
        try:
            while self.socket.recv(1 << 16):
                pass
        except OSError:
            pass
        self.connected = False

    def send(self, kind, body):
        envelope = field(kind, body)
        self.socket.sendall(struct.pack(">I", len(envelope)) + envelope)

    def look(self, sequence, width, height):
        self.send(CAMERA, field(1, sequence) + field(3, pose(0.7 * sequence, width, height)))


class RudeClients(unittest.TestCase):
    def test_the_largest_viewport_in_motion_holds_up_neither_others_nor_the_stop(self):
        with Folder() as folder:
            daemon = Daemon(Path(folder) / "state")
            rude = [Client(daemon.tcp).enter() for _ in range(2)]
            done = threading.Event()

            def move():
                sequence = 0
                while not done.wait(0.3):
                    sequence += 1
                    for client in rude:
                        try:
                            client.look(sequence, 16384, 16384)
                        except OSError:
                            return  # the daemon is gone

            mover = threading.Thread(target=move)
            mover.start()
            time.sleep(1)
            try:
                report = probe(daemon.tcp, Path(folder) / "picture.png", "--seconds", "4")
                still_there = [client.connected for client in rude]
            finally:
                start = time.monotonic()
                code = daemon.stop()
                stopped = time.monotonic() - start
                done.set()
                mover.join()
            self.assertEqual(code, 0)
            self.assertEqual(still_there, [True, True])  # or nobody was rude
            self.assertLess(report["seconds_to_first_image"], 3)
            self.assertLess(stopped, 3)

    def test_a_daemon_that_was_held_up_lets_in_who_spoke_in_time_and_counts_who_did_not(self):
        with Folder() as folder:
            daemon = Daemon(Path(folder) / "state")
            self.addCleanup(daemon.process.kill)
            speaks, silent = Client(daemon.tcp), Client(daemon.tcp)
            time.sleep(0.5)  # both are accepted, and have ten seconds
            daemon.process.send_signal(signal.SIGSTOP)
            speaks.hello()
            time.sleep(11)
            daemon.process.send_signal(signal.SIGCONT)
            speaks.welcomed()
            silent.socket.settimeout(5)
            self.assertEqual(silent.socket.recv(1), b"")
            self.assertEqual(daemon.values()['darm_session_events_total{what="said_nothing"}'], 1)
            self.assertEqual(daemon.stop(), 0)

    def test_ends_are_counted_by_reason_and_what_alerts_watch_is_there_from_the_start(self):
        with Folder() as folder:
            daemon = Daemon(Path(folder) / "state")
            self.addCleanup(daemon.process.kill)
            before = daemon.values()
            for series in ('darm_session_events_total{what="server_full"}', 'darm_sessions_closed_total{reason="TOO_SLOW"}',
                           'darm_sessions_closed_total{reason="VERSION_UNSUPPORTED"}', "darm_encoder_failures_total"):
                self.assertEqual(before[series], 0)
            old, leaving, gone = Client(daemon.tcp), Client(daemon.tcp), Client(daemon.tcp)
            old.send(HELLO, field(1, VERSION - 1) + field(2, b"old") + field(4, 2048))
            leaving.enter().send(GOODBYE, b"")
            gone.enter().socket.shutdown(socket.SHUT_RDWR)
            silent = socket.create_connection(("127.0.0.1", daemon.tcp))
            silent.close()

            def counted(name):
                return daemon.values().get(name, 0)

            for reason in ("VERSION_UNSUPPORTED", "left", "connection_lost"):
                wait_until(lambda: counted('darm_sessions_closed_total{reason="%s"}' % reason) == 1, 5, reason)
            wait_until(lambda: counted('darm_session_events_total{what="left_at_once"}') == 1, 5, "left_at_once")
            self.assertEqual(daemon.stop(), 0)

    def test_too_few_descriptors_are_told_at_the_start(self):
        with Folder() as folder:
            allowed = resource.getrlimit(resource.RLIMIT_NOFILE)
            resource.setrlimit(resource.RLIMIT_NOFILE, (150, allowed[1]))
            try:
                daemon = Daemon(Path(folder) / "state")
            finally:
                resource.setrlimit(resource.RLIMIT_NOFILE, allowed)
            self.addCleanup(daemon.process.kill)
            self.assertIn("150 file descriptors are allowed, and 64 clients", daemon.messages())
            self.assertEqual(daemon.stop(), 0)

    def test_who_connects_to_the_metrics_and_says_nothing_does_not_hold_up_the_stop(self):
        with Folder() as folder:
            daemon = Daemon(Path(folder) / "state")
            self.addCleanup(daemon.process.kill)
            idle = [socket.create_connection(("127.0.0.1", daemon.metrics)) for _ in range(10)]
            time.sleep(0.2)
            start = time.monotonic()
            daemon.process.send_signal(signal.SIGTERM)
            wait_until(lambda: "stopped" in daemon.messages(), 10, "stopped")
            daemon.process.wait(timeout=0.5)  # what has said so is gone
            self.assertEqual(daemon.stop(), 0)
            self.assertLess(time.monotonic() - start, 5)
            for one in idle:
                one.close()


if __name__ == "__main__":
    unittest.main(verbosity=2)
