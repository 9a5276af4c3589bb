"""One plant step in which the first body of a chain sticks and slips, as machine code (numba).

The formulas are those of ``stick_slip`` and ``substeps``, unchanged, and so are the results, to the bit. Their array
operations are written here as loops, and all of it is inlined where it is called: passing arguments would take longer.
"""

from __future__ import annotations

from functools import partial

from haploop.plant.friction import stick_slip, substeps
from haploop.protocol.machine_code import MachineCode

_code = MachineCode(__file__, (stick_slip, substeps))
_inlined = partial(_code.compiled, inlined=True)
# No chain has more states; what acts on them are the states themselves and four inputs.
STATES, ACTS = 8, 12
NONE = (0.0,) * STATES


# Tables come in two layouts: with the moved states side by side, padded to ``STATES``, to move all of them at once; and
# with what acts side by side, to move one of them.


@_inlined
def add_up(table, z, total):  # pragma: no cover
    """Adds (what acts) times (each row of a table), row by row, to ``total``, all states at once."""
    a, b, c, d, e, f, g, h = total
    for i in range(len(table)):
        row, acts = table[i], z[i]
        a, b, c, d = a + row[0] * acts, b + row[1] * acts, c + row[2] * acts, d + row[3] * acts
        e, f, g, h = e + row[4] * acts, f + row[5] * acts, g + row[6] * acts, h + row[7] * acts
    return a, b, c, d, e, f, g, h


@_inlined
def _moved(tables, of, z, z_comp, command, friction, load, rise, after, comp):  # pragma: no cover
    table = tables[0][of[0], of[1]]
    size = len(table) - 4
    after[size], after[size + 1], after[size + 2], after[size + 3] = command, friction, load, rise
    for i in range(size):
        after[i] = z[i]
    a, b, c, d, e, f, g, h = add_up(table, after, NONE)
    comp[0], comp[1], comp[2], comp[3], comp[4], comp[5], comp[6], comp[7] = a, b, c, d, e, f, g, h
    for j in range(STATES):
        total = comp[j] + z_comp[j]
        end = z[j] + total
        after[j] = end
        comp[j] = total - (end - z[j])


@_inlined
def _one_moved(tables, of, at, z, z_comp, command, friction, load, rise):  # pragma: no cover
    row, total = tables[1][of[0], of[1], at], 0.0
    size = len(row) - 4
    for i in range(size):
        total += row[i] * z[i]
    total = total + row[size] * command + row[size + 1] * friction
    total = total + row[size + 2] * load + row[size + 3] * rise
    return z[at] + (total + z_comp[at])


@_inlined
def row_on(row, z, command, load):  # pragma: no cover
    total = row.of_command * command + row.of_load * load
    for i in range(STATES):
        if row.of_states[i] != 0.0:
            total = total + row.of_states[i] * z[i]
    return total


@_inlined
def _force_moved(row, tables, of, z, z_comp, command, friction, load, rise, end_load):  # pragma: no cover
    force = row.of_command * command + row.of_load * end_load
    for i in range(STATES):
        if row.of_states[i] != 0.0:
            end = _one_moved(tables, of, i, z, z_comp, command, friction, load, rise)
            force = force + row.of_states[i] * end
    return force


@_inlined
def _take_over(z, z_comp, next_z, next_comp):  # pragma: no cover
    for i in range(STATES):
        z[i], z_comp[i] = next_z[i], next_comp[i]


@_inlined
def _same(z):  # pragma: no cover
    return z


@_inlined
def _read(values, z):  # pragma: no cover
    pass


# Pieces are rows of ``substeps.pieces_record``; a last row has their number, which counts those without room, too.


@_inlined
def _count_of(pieces):  # pragma: no cover
    return int(pieces[-1, 0])


@_inlined
def _drop_last(pieces):  # pragma: no cover
    pieces[-1, 0] -= 1.0


@_inlined
def _is_full(pieces, first, step):  # pragma: no cover
    return pieces[-1, 0] >= len(pieces)


@_inlined
def _note(pieces, of, head, begin, comp):  # pragma: no cover
    at, size = int(pieces[-1, 0]), pieces.shape[1] - 6 - of.v
    pieces[-1, 0] += 1.0
    if at < len(pieces) - 1:
        pieces[at, 0], pieces[at, 1], pieces[at, 2], pieces[at, 3], pieces[at, 4], pieces[at, 5] = head
        for i in range(size):
            pieces[at, 6 + i] = begin[i]
        for i in range(of.v):
            pieces[at, 6 + size + i] = comp[i]


_friction_at, holds_against = _inlined(stick_slip.friction_at), _inlined(stick_slip.holds_against)
_forces = {"row_on": row_on, "holds_against": holds_against}
decide_at_rest = _inlined(stick_slip.decide_at_rest, **_forces)
holds_through = _inlined(stick_slip.holds_through, **_forces)
_tangents = _inlined(stick_slip.tangents_meet_below)
may_switch_within = _inlined(stick_slip.may_switch_within, row_on=row_on, tangents_meet_below=_tangents)
creeps = _inlined(stick_slip.creeps)
slipping = _inlined(stick_slip.slipping)
slipping_at = _inlined(stick_slip.slipping_at, friction_at=_friction_at)
solve_step = _code.compiled(
    substeps.solve_step,
    decide_at_rest=decide_at_rest,
    may_switch_within=may_switch_within,
    creeps=creeps,
    friction_over=_inlined(substeps.friction_over, friction_at=_friction_at, one_moved=_one_moved),
    holds_after=_inlined(
        substeps.holds_after, holds_against=holds_against, one_moved=_one_moved, force_moved=_force_moved
    ),
    at_rest=_inlined(substeps.at_rest),
    **_forces,
    moved=_moved,
    take_over=_take_over,
    numbers=_same,
    read=_read,
    note=_note,
    count_of=_count_of,
    drop_last=_drop_last,
    is_full=_is_full,
)
