"""Two hosts on one machine: network namespaces joined by a wire that delays, loses or cuts off packets.

The wire is a thread between two TUN devices. Where the kernel has netem, ``tc`` makes it delay and lose packets at the
devices, and the thread carries the rest; else the thread does so for each IP packet separately, as netem does, so that
TCP retransmits what is lost.
"""

from __future__ import annotations

import contextlib
import fcntl
import heapq
import json
import os
import random
import select
import shutil
import struct
import subprocess
import threading
import time
from collections.abc import Iterator
from itertools import count

_TUNSETIFF, _TUN_WITHOUT_HEADER = 0x400454CA, 0x1001
A, B = "10.77.0.1", "10.77.0.2"
A6 = "fd77::1"


def why_not() -> str:
    """Why there can be no namespaces here; "" where there can."""
    if os.geteuid() != 0:
        return "network namespaces need root"
    if not shutil.which("ip"):
        return "ip of iproute2 is not installed"
    if not os.access("/dev/net/tun", os.R_OK | os.W_OK):
        return "this kernel has no TUN devices"
    tried = subprocess.run(["ip", "netns", "add", _name("try")], capture_output=True, text=True)
    subprocess.run(["ip", "netns", "del", _name("try")], capture_output=True)
    return tried.stderr.strip()


def _name(host: str) -> str:
    return f"haploop{os.getpid()}{host}"


class Wire:
    """The wire between host "a" and host "b".

    Args:
        delay_s: delay of each packet, one way.
        loss: share of the packets that are lost.
        is_by_netem: whether the kernel does both.

    Attributes:
        by: what delays and loses packets.
        is_cut: whether nothing gets through.
    """

    def __init__(self, ends: tuple[int, int], delay_s: float, loss: float, is_by_netem: bool = False) -> None:
        self.by = "tc netem" if is_by_netem else "a thread, since this kernel has no netem"
        self.delay_s, self.loss, self.is_cut = (0.0, 0.0, False) if is_by_netem else (delay_s, loss, False)
        self._lost = 0
        self._ends, self._over, self._draw = ends, False, random.Random(1)
        self._thread = threading.Thread(target=self._carry, daemon=True)
        self._thread.start()

    def _carry(self) -> None:
        under_way: list[tuple[float, int, int, bytes]] = []
        number = count()
        while not self._over:
            wait_s = max(0.0, under_way[0][0] - time.monotonic()) if under_way else 0.1
            for end in select.select(self._ends, [], [], min(wait_s, 0.1))[0]:
                packet = os.read(end, 65536)
                if self.is_cut or self._draw.random() < self.loss:
                    self._lost += 1
                    continue
                other = self._ends[1] if end == self._ends[0] else self._ends[0]
                heapq.heappush(under_way, (time.monotonic() + self.delay_s, next(number), other, packet))
            while under_way and under_way[0][0] <= time.monotonic():
                _, _, other, packet = heapq.heappop(under_way)
                if not self.is_cut:
                    with contextlib.suppress(OSError):
                        os.write(other, packet)

    @property
    def lost(self) -> int:
        """Number of packets lost so far."""
        return self._lost + sum(_dropped(host) for host in "ab")

    def close(self) -> None:
        self._over = True
        self._thread.join()
        for end in self._ends:
            os.close(end)


def on(host: str, command: list[str]) -> list[str]:
    """The command as one of host "a" (address ``A``, ``A6``) or "b" (address ``B``)."""
    return ["ip", "netns", "exec", _name(host), *command]


@contextlib.contextmanager
def two_hosts(delay_s: float = 0.0, loss: float = 0.0) -> Iterator[Wire]:
    """Makes both hosts and their wire, and removes them afterwards."""
    ends = []
    try:
        for host, own, own6 in (("a", A, A6), ("b", B, "fd77::2")):
            _ip("netns", "add", _name(host))
            end = os.open("/dev/net/tun", os.O_RDWR)
            ends.append(end)
            device = _device(host)
            fcntl.ioctl(end, _TUNSETIFF, struct.pack("16sH22x", device.encode(), _TUN_WITHOUT_HEADER))
            _ip("link", "set", device, "netns", _name(host))
            inside = ("-n", _name(host))
            _ip(*inside, "addr", "add", f"{own}/24", "dev", device)
            _ip(*inside, "addr", "add", f"{own6}/64", "dev", device, "nodad")
            for name in (device, "lo"):  # a queue for a whole window of telemetry, or packets are lost here
                _ip(*inside, "link", "set", name, "txqueuelen", "20000", "up")
        is_by_netem = shutil.which("tc") is not None and all(_shape(host, delay_s, loss) for host in "ab")
        wire = Wire((ends[0], ends[1]), delay_s, loss, is_by_netem)
        try:
            yield wire
        finally:
            wire.close()
    finally:
        for host in "ab":
            subprocess.run(["ip", "netns", "del", _name(host)], capture_output=True)


def _device(host: str) -> str:
    return f"hl{os.getpid()}{host}"[:15]


def _shape(host: str, delay_s: float, loss: float) -> bool:
    """Makes the kernel delay and lose what a host sends; tells whether it can."""
    netem = ["netem", "delay", f"{1e3 * delay_s}ms", "loss", f"{100 * loss}%", "limit", "100000"]
    words = ["tc", "-n", _name(host), "qdisc", "add", "dev", _device(host), "root", *netem]
    return subprocess.run(words, capture_output=True).returncode == 0


def _dropped(host: str) -> int:
    """Number of packets sent by a host that the kernel has lost."""
    words = ["tc", "-n", _name(host), "-s", "-j", "qdisc", "show", "dev", _device(host)]
    said = subprocess.run(words, capture_output=True, text=True) if shutil.which("tc") else None
    found = json.loads(said.stdout or "[]") if said else []
    return sum(queue["drops"] for queue in found if queue["kind"] == "netem")


def _ip(*words: str) -> None:
    subprocess.run(["ip", *words], check=True, capture_output=True)
