"""Published stiffnesses of walls on the devices that come with haploop, each with its source."""

from __future__ import annotations

from typing import NamedTuple


class Published(NamedTuple):
    """A stiffness in N/m that somebody states or shows, what it is, and where."""

    stiffness_N_m: float
    what: str
    source: str


_CHAI3D = "CHAI3D, the largest stiffness its driver states for the device"
_PREMIUM = (
    Published(800.0, "the driver's limit", _CHAI3D),
    Published(3500.0, "the maker's data sheet", "SensAble, data sheet of the PHANToM Premium 1.5"),
    Published(6300.0, "shown, with damping and unidirectional inertia", "Choi et al. 2022"),
    Published(10_000.0, "shown, with successive force augmentation",
              "Singh, Janetzko, Jafari, Weber, Lee, Ryu, IEEE Trans. Industrial Electronics, 2019"),
)  # fmt: skip
PUBLISHED: dict[str, tuple[Published, ...]] = {
    "premium15": _PREMIUM,
    "premium15_cable": _PREMIUM,
    "touch": (
        Published(400.0, "the driver's limit", _CHAI3D),
        Published(700.0, "the driver's limit for the Omni, its predecessor", _CHAI3D),
    ),
    "omega3": (Published(5000.0, "the driver's limit", _CHAI3D),),
    "falcon": (Published(3000.0, "the driver's limit", _CHAI3D),),
}
