"""Trees of numbers: states and parameters as nested containers, changed leaf by leaf.

Nodes are NamedTuples, tuples, lists, dicts, dataclasses and None (a node without children); a dataclass is rebuilt from
its fields alone, without its ``__init__``. All else is a leaf: floats, ints, bools, strings, arrays, functions.

In a batch the rule is: **every array of a state or of parameters has the members as its last axis, of length 1 where
all members share it; every other leaf is shared by all.** So nothing is guessed from lengths.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    import numpy as np

T = TypeVar("T")


def tree_map(function: Callable[..., Any], tree: T, *rest: Any) -> T:
    """Returns the tree with ``function(leaf, *leaves of the rest at the same place)`` in place of every leaf.

    Raises ValueError where a node of the rest has a different number of children, or a dict other keys.
    """
    children = _children(tree)
    if children is None:
        return function(tree, *rest)
    others = [_children(_in_order(tree, other)) for other in rest]
    if any(other is None or len(other) != len(children) for other in others):
        raise ValueError(f"The trees differ in structure at a node of type {type(tree).__name__}.")
    columns = zip(children, *(other or [] for other in others), strict=True)
    return _rebuilt(tree, [tree_map(function, *column) for column in columns])


def _in_order(tree: Any, other: Any) -> Any:
    """Returns the children of another dict in the order of the keys of this one; anything but two dicts unchanged."""
    if not (isinstance(tree, dict) and isinstance(other, dict)):
        return other
    if other.keys() != tree.keys():
        raise ValueError("The trees differ in structure at a node of type dict.")
    return [other[key] for key in tree]


def tree_leaves(tree: Any) -> list[Any]:
    """Returns the leaves, depth first, dicts in the order of their insertion."""
    children = _children(tree)
    return [tree] if children is None else [leaf for child in children for leaf in tree_leaves(child)]


def tree_unflatten(tree: T, leaves: Iterable[Any]) -> T:
    """Returns the tree with these leaves, in the order of ``tree_leaves``; ValueError for too few or too many."""
    left: Iterator[Any] = iter([*leaves])
    try:
        rebuilt = tree_map(lambda _: next(left), tree)
    except StopIteration:
        raise ValueError("There are fewer leaves than the tree has.") from None
    if next(left, left) is not left:
        raise ValueError("There are more leaves than the tree has.")
    return rebuilt


def tree_select(tree: T, kept: np.ndarray) -> T:
    """Returns the tree of the members to keep; ``kept`` has a truth value for every member, shape (members,).

    Raises ValueError where the last axis of an array has neither length 1 nor the length of ``kept``.
    """
    import numpy as np

    return tree_map(lambda leaf: np.compress(kept, leaf, axis=-1) if _has_members(leaf, len(kept)) else leaf, tree)


def tree_take(tree: T, places: np.ndarray) -> T:
    """Returns the tree of the members at these places, shape (members taken,), in their order.

    An array whose last axis has length 1 is left as it is.
    """
    return tree_map(lambda leaf: leaf[..., places] if _has_members(leaf) else leaf, tree)


def tree_member(tree: T, place: int) -> T:
    """Returns the tree of one member: an array of shape (members,) becomes its number, one of more axes loses its last.

    An array whose last axis has length 1 holds for every member.
    """

    def of_member(leaf: Any) -> Any:
        shape = getattr(leaf, "shape", ())
        if not shape:
            return leaf
        one = leaf[..., place if shape[-1] != 1 else 0]
        return one if len(shape) > 1 else one.item()

    return tree_map(of_member, tree)


def tree_by_member(tree: Any, members: int) -> list[Any]:
    """Returns a separate tree for every member; the nodes are dicts and lists, the arrays have shape (members,)."""
    if isinstance(tree, dict):
        return [dict(zip(tree, row, strict=True)) for row in _by_member([*tree.values()], members)]
    if isinstance(tree, list):
        return [list(row) for row in _by_member(tree, members)]
    return tree.tolist() if _has_members(tree) else [_shared(tree)] * members


def _by_member(children: list[Any], members: int) -> list[tuple[Any, ...]]:
    columns = [tree_by_member(child, members) for child in children]
    return list(zip(*columns, strict=True)) if children else [()] * members


def _shared(leaf: Any) -> Any:
    return leaf.item() if getattr(leaf, "shape", ()) else leaf


def _has_members(leaf: Any, members: int = 0) -> bool:
    """Tells whether a leaf is an array with a number for each member on its last axis."""
    shape = getattr(leaf, "shape", ())
    if not shape or shape[-1] == 1:
        return False
    if members and shape[-1] != members:
        raise ValueError(f"An array of shape {shape} has no last axis for {members} members.")
    return True


def _children(tree: Any) -> list[Any] | None:
    if isinstance(tree, tuple | list):
        return [*tree]
    if isinstance(tree, dict):
        return [*tree.values()]
    if tree is None:
        return []
    if is_dataclass(tree) and not isinstance(tree, type):
        return [getattr(tree, field.name) for field in fields(tree)]
    return None


def _rebuilt(tree: Any, children: list[Any]) -> Any:
    if isinstance(tree, tuple):
        return type(tree)(*children) if hasattr(tree, "_fields") else tuple(children)
    if isinstance(tree, list):
        return children
    if isinstance(tree, dict):
        return dict(zip(tree, children, strict=True))
    if tree is None:
        return None
    rebuilt = object.__new__(type(tree))
    for field, child in zip(fields(tree), children, strict=True):
        object.__setattr__(rebuilt, field.name, child)
    return rebuilt
