"""A TCP link of a set rate and delay before a port of this machine: what a visitor far away has in between.

As a program: slow_link.py PORT [--mbit 20] [--rtt 40], prints the port to connect to and runs until it is stopped.
"""
import argparse
import asyncio
import socket
import threading

PIECE = 4096  # bytes that leave at once; at 20 Mbit/s 1.6 ms
ROUTER_SECONDS = 0.05  # what may wait before the sender is held back


def small_window():
    """A socket that takes little in, so that the link holds the sender back and not a buffer of some megabytes."""
    sock = socket.socket()
    sock.setblocking(False)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 65536)
    return sock


class SlowLink:
    """Serves in a thread of its own until `stop`. Bytes leave at `mbit` megabits a second, each way by itself, and
    arrive half of `rtt_ms` later; a connection is there after one round trip, as a handshake takes."""

    def __init__(self, port, mbit=20.0, rtt_ms=40.0):
        self.to, self.rate, self.delay = port, mbit * 1e6 / 8, rtt_ms / 2000
        self.loop = asyncio.new_event_loop()
        self.started = threading.Event()
        self.thread = threading.Thread(target=self._run, daemon=True)
        self.thread.start()
        self.started.wait()

    def stop(self):
        self.loop.call_soon_threadsafe(self.loop.stop)
        self.thread.join()

    def _run(self):
        asyncio.set_event_loop(self.loop)
        ear = small_window()
        ear.bind(("127.0.0.1", 0))
        server = self.loop.run_until_complete(asyncio.start_server(self._connected, sock=ear, limit=PIECE))
        self.port = server.sockets[0].getsockname()[1]
        self.started.set()
        self.loop.run_forever()
        server.close()
        tasks = asyncio.all_tasks(self.loop)
        for task in tasks:
            task.cancel()
        self.loop.run_until_complete(asyncio.gather(*tasks, return_exceptions=True))
        self.loop.run_until_complete(asyncio.sleep(0))
        self.loop.close()

    async def _connected(self, near_in, near_out):
        await asyncio.sleep(2 * self.delay)
        try:
            far = small_window()
            await self.loop.sock_connect(far, ("127.0.0.1", self.to))
            far_in, far_out = await asyncio.open_connection(sock=far, limit=PIECE)
        except OSError:
            near_out.close()
            return
        try:
            await asyncio.gather(self._carry(near_in, far_out), self._carry(far_in, near_out))
        except asyncio.CancelledError:
            pass
        finally:
            for end in (near_out, far_out):  # both hear of it: a server that does not keeps a ghost for its time-out
                end.transport.abort()

    async def _carry(self, source, sink):
        pieces = asyncio.Queue()
        deliver = asyncio.ensure_future(self._deliver(pieces, sink))
        free_at = 0.0
        try:
            while data := await source.read(PIECE):
                now = self.loop.time()
                free_at = max(now, free_at) + len(data) / self.rate
                pieces.put_nowait((free_at + self.delay, data))
                if free_at - now > ROUTER_SECONDS:
                    await asyncio.sleep(free_at - now - ROUTER_SECONDS)
        except ConnectionError:
            pass
        pieces.put_nowait((0.0, b""))
        await deliver

    async def _deliver(self, pieces, sink):
        try:
            while True:
                at, data = await pieces.get()
                if not data:
                    break
                await asyncio.sleep(max(0.0, at - self.loop.time()))
                sink.write(data)
                await sink.drain()
        except ConnectionError:
            pass
        sink.close()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("port", type=int)
    parser.add_argument("--mbit", type=float, default=20.0)
    parser.add_argument("--rtt", type=float, default=40.0, help="milliseconds, there and back")
    arguments = parser.parse_args()
    link = SlowLink(arguments.port, arguments.mbit, arguments.rtt)
    print(link.port, flush=True)
    link.thread.join()


if __name__ == "__main__":
    main()
