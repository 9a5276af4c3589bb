"""Two hosts on one machine: network namespaces joined by a wire that delays, loses or cuts what goes through it.

The wire is a thread between two TUN devices, since not every kernel has netem; it treats each IP packet by itself, as
netem does, so that TCP retransmits what is lost.
"""

from __future__ import annotations

import contextlib
import fcntl
import heapq
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

    Attributes:
        delay_s: of each packet, one way.
        loss: share of the packets that are lost.
        is_cut: nothing comes through.
        carried, lost: packets so far.
    """

    def __init__(self, ends: tuple[int, int], delay_s: float, loss: float) -> None:
        self.delay_s, self.loss, self.is_cut = delay_s, loss, False
        self.carried = self.lost = 0
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
                    self.lost += 1
                    continue
                other = self._ends[1] if end == self._ends[0] else self._ends[0]
                heapq.heappush(under_way, (time.monotonic() + self.delay_s, next(number), other, packet))
            while under_way and under_way[0][0] <= time.monotonic():
                _, _, other, packet = heapq.heappop(under_way)
                if not self.is_cut:
                    with contextlib.suppress(OSError):
                        os.write(other, packet)
                        self.carried += 1

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
    """Makes both hosts and their wire; afterwards none of it is left."""
    ends = []
    try:
        for host, own, own6 in (("a", A, A6), ("b", B, "fd77::2")):
            _ip("netns", "add", _name(host))
            end = os.open("/dev/net/tun", os.O_RDWR)
            ends.append(end)
            device = f"hl{os.getpid()}{host}"[:15]
            fcntl.ioctl(end, _TUNSETIFF, struct.pack("16sH22x", device.encode(), _TUN_WITHOUT_HEADER))
            _ip("link", "set", device, "netns", _name(host))
            inside = ("-n", _name(host))
            _ip(*inside, "addr", "add", f"{own}/24", "dev", device)
            _ip(*inside, "addr", "add", f"{own6}/64", "dev", device, "nodad")
            for name in (device, "lo"):
                _ip(*inside, "link", "set", name, "up")
        wire = Wire((ends[0], ends[1]), delay_s, loss)
        try:
            yield wire
        finally:
            wire.close()
    finally:
        for host in "ab":
            subprocess.run(["ip", "netns", "del", _name(host)], capture_output=True)


def _ip(*words: str) -> None:
    subprocess.run(["ip", *words], check=True, capture_output=True)
