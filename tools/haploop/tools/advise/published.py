"""Published stiffnesses of walls on the devices that come with haploop, each with its source."""

from __future__ import annotations

from typing import NamedTuple


class Published(NamedTuple):
    """A stiffness in N/m that somebody states or shows, by whom, and what it is.

    Attributes:
        by: in a word or two.
        source: in full.
    """

    stiffness_N_m: float
    by: str
    source: str


def _driver(stiffness_N_m: float, of: str = "the device") -> Published:
    return Published(stiffness_N_m, "CHAI3D", f"the largest stiffness that CHAI3D's driver states for {of}")


_PREMIUM = (
    _driver(800.0),
    Published(3500.0, "its maker", "SensAble, data sheet of the PHANToM Premium 1.5"),
    Published(6300.0, "Choi et al. 2022", "shown with damping and unidirectional inertia together"),
    Published(10_000.0, "Singh et al. 2019", "shown with successive force augmentation (Singh, Janetzko, Jafari, "
              "Weber, Lee, Ryu, IEEE Trans. Industrial Electronics)"),
)  # fmt: skip
PUBLISHED: dict[str, tuple[Published, ...]] = {
    "premium15": _PREMIUM,
    "premium15_cable": _PREMIUM,
    "touch": (_driver(400.0), _driver(700.0, "the Omni, its predecessor")),
    "omega3": (_driver(5000.0),),
    "falcon": (_driver(3000.0),),
}
