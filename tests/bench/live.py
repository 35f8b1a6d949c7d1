"""What the live page costs the logger: processor at rig speed with two pages open, and memory over hours of rig data
with a page that does not keep up. Viewers are plain sockets in this process."""

import os
import pathlib
import re
import socket
import subprocess
import sys
import threading
import time

program, scratch = sys.argv[1], pathlib.Path(sys.argv[2])
SECONDS = int(os.environ.get("LIVE_SECONDS", "30"))
HOURS = float(os.environ.get("LIVE_HOURS", "1"))
SPEED = 60  # times real time, for the hours


class Viewer:
    """Reads events; a slow one takes 2 kB, ten times a second, from a small buffer: less than is sent."""

    def __init__(self, port, slow=False):
        self.bytes = 0
        self.frames = 0
        self.slow = slow
        self.connections = 0
        self.port = port
        threading.Thread(target=self.work, daemon=True).start()

    def work(self):
        while True:
            try:
                self.connect()
            except OSError:
                pass
            time.sleep(0.2)

    def connect(self):
        with socket.socket() as connection:
            if self.slow:
                connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            connection.connect(("127.0.0.1", self.port))
            connection.sendall(f"GET /events HTTP/1.1\r\nHost: 127.0.0.1:{self.port}\r\n\r\n".encode())
            self.connections += 1
            while data := connection.recv(2048 if self.slow else 1 << 20):
                self.bytes += len(data)
                self.frames += data.count(b"event: frames")
                if self.slow:
                    time.sleep(0.1)


def cpu_s(pid):
    """Of all threads that live, to the nanosecond; ticks of the clock would be half of what is measured here."""
    return sum(int((task / "schedstat").read_text().split()[0]) for task in pathlib.Path(f"/proc/{pid}/task").iterdir()) / 1e9


def resident_MB(pid):
    return int(re.search(r"VmRSS:\s+(\d+)", pathlib.Path(f"/proc/{pid}/status").read_text())[1]) / 1024


def remove(db):
    for suffix in ("", "-wal", "-shm", ".lock"):
        pathlib.Path(f"{db}{suffix}").unlink(missing_ok=True)


class Board:
    """What the virtual rig sent in a run of SECONDS + 10, sent again over TCP in time: a board in another process."""

    def __init__(self):
        db, capture = scratch / "board.db", scratch / "board.bytes"
        remove(db)
        self.seconds = SECONDS + 10
        subprocess.run([program, "log", "--db", db, "--location", "OT", "--session", "S1", "--duration", str(self.seconds),
                        "--speed", "max", "--capture", capture], check=True, capture_output=True)
        self.data = capture.read_bytes()
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.name = f"tcp:127.0.0.1:{self.listener.getsockname()[1]}"
        threading.Thread(target=self.work, daemon=True).start()

    def work(self):
        while True:
            connection, _ = self.listener.accept()
            threading.Thread(target=self.send, args=(connection,), daemon=True).start()

    def send(self, connection):
        began, sent = time.monotonic(), 0
        try:
            while sent < len(self.data):
                due = int(len(self.data) * (time.monotonic() - began) / self.seconds)
                connection.sendall(self.data[sent:due])
                sent = max(sent, due)
                time.sleep(0.012)
        except OSError:
            pass


def start(name, *options):
    db = scratch / f"{name.replace(' ', '_')}.db"
    remove(db)
    logger = subprocess.Popen(
        [program, "log", "--db", db, "--location", "OT", "--session", "S1", "--yes", *options],
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    if "--live" not in options:
        return logger, None
    return logger, int(re.search(r":(\d+)/", logger.stdout.readline())[1])


def processor(name, viewers, *options):
    logger, port = start(name, "--duration", str(SECONDS + 10), *options)
    watching = [Viewer(port) for _ in range(viewers)] if port else []
    time.sleep(4)  # buffers filled, plans of transforms made
    before, began = cpu_s(logger.pid), time.monotonic()
    frames = sum(viewer.frames for viewer in watching)
    time.sleep(SECONDS)
    used = (cpu_s(logger.pid) - before) / (time.monotonic() - began)
    rate = (sum(viewer.frames for viewer in watching) - frames) / SECONDS / max(1, viewers)
    logger.kill()
    logger.wait()
    print(f"{name:30} {100 * used:5.2f} % of a core" + (f", {rate:.1f} frame events a second each" if viewers else ""),
          flush=True)
    return used


def memory():
    logger, port = start("memory", "--duration", str(int(3600 * HOURS)), "--speed", str(SPEED), "--live", "0")
    fast, slow = Viewer(port), Viewer(port, slow=True)
    sizes, began = [], time.monotonic()
    while logger.poll() is None:
        time.sleep(0.5)
        try:
            sizes.append(resident_MB(logger.pid))
        except (OSError, TypeError):
            break
    logger.wait()
    quarter = max(1, len(sizes) // 4)
    early, late = max(sizes[quarter:2 * quarter]), max(sizes[-quarter:])
    print(f"\n{HOURS:g} h of rig data in {time.monotonic() - began:.0f} s, exit code {logger.returncode}: "
          f"{early:.1f} MB in the second quarter, {late:.1f} MB in the last; "
          f"the page that keeps up read {fast.bytes / 1e6:.1f} MB, the slow one {slow.bytes / 1e6:.1f} MB "
          f"over {slow.connections} connections")
    return late - early


print(f"logger at rig speed, {SECONDS} s each, whole process\n")
board = Board()
alone = processor("without a page", 0, "--source", board.name)
processor("nobody looks", 0, "--source", board.name, "--live", "0")
two = processor("two pages", 2, "--source", board.name, "--live", "0")
processor("two pages, virtual rig within", 2, "--live", "0")
print(f"two pages cost {100 * (two - alone):.2f} % of a core (goal: the whole logger under 3 %)")
grown = memory()
sys.exit(0 if two < 0.03 and grown < 4 else 1)
