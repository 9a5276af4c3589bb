"""An advice made up for tests: damping is advised, two elements fell, and changes gain and lose."""

import math
from dataclasses import replace

from haploop.tools.advise.advice import Advice, Changed
from haploop.tools.advise.changes import Borne
from haploop.tools.advise.families import BOTH, DAMPING, NOTHING, UNIDIRECTIONAL
from haploop.tools.advise.known import Formula, Published
from haploop.tools.advise.search import Found
from haploop.tools.advise.walls.limit import Limit
from haploop.tools.advise.withstand import Best


def limit(stiffness_N_m: float) -> Limit:
    return Limit(stiffness_N_m, 1.1 * stiffness_N_m)


def changed(words: str, stiffness_N_m: float, alone_N_m: float) -> Changed:
    base = Borne(limit(2900.0), limit(2100.0))
    return Changed.from_borne(words, Borne(limit(stiffness_N_m), limit(alone_N_m)), base)


ALONE = Best(NOTHING, (), limit(2100.0))
DAMPED = Best(DAMPING, (1.1,), limit(2900.0), limit(1700.0))
TWO = Best(BOTH, (1.1, 2e-3), limit(3100.0), limit(2000.0))
ONE = Best(UNIDIRECTIONAL, (2e-3,), limit(2700.0), limit(1800.0))
FOUND = Found((ALONE, DAMPED, TWO, ONE), DAMPED, 1640.0, None, None, 10, fell=((TWO, 1530.0),), alone_N_m=910.0)
NONE_KNOWN = Formula("K <= 2 b / T", "", "", "its source", 0.0)
ADVICE = Advice(
    name="mine", notes=(), is_ideal=False, tried_by="a tap", uncertain={}, not_varied=(), hand=None, grip=None,
    found=FOUND, formulas=(NONE_KNOWN, replace(NONE_KNOWN, stiffness_N_m=math.inf)),
    published=(Published(800.0, "a maker", ""),),
    unchanged=changed("unchanged", 2900.0, 2100.0), changed=(changed("ticks twice as often", 5800.0, 2310.0),),
    without=(changed("no friction", 127.0, 127.0), changed("no actuator limits", 2750.0, 2100.0)), assumed=(),
    own=None, scene=None, breaks=None, runs=1,
)  # fmt: skip
