"""Trees of numbers keep their structure, and members are chosen by the rule of the last axis alone."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pytest

from haploop.protocol.trees import (
    tree_by_member,
    tree_leaves,
    tree_map,
    tree_member,
    tree_select,
    tree_take,
    tree_unflatten,
)


def test_dicts_are_paired_by_their_keys() -> None:
    assert tree_map(lambda a, b: a + b, {"a": 1, "b": 2}, {"b": 20, "a": 10}) == {"a": 11, "b": 22}
    with pytest.raises(ValueError, match="differ in structure"):
        tree_map(lambda a, b: a + b, {"a": 1, "b": 2}, {"b": 20, "c": 10})
    with pytest.raises(ValueError, match="differ in structure"):
        tree_map(lambda a, b: a + b, {}, {"b": 20})


class Pair(NamedTuple):
    first: Any
    second: Any


@dataclass(frozen=True)
class Gain:
    gain: Any
    name: str

    def __post_init__(self) -> None:
        assert isinstance(self.gain, float), "a dataclass is rebuilt without its __init__"


TREE = {"pair": Pair(1.0, (2, [3.0, None])), "gain": Gain(4.0, "g")}


def test_leaves_put_back_give_the_same_tree():
    assert tree_leaves(TREE) == [1.0, 2, 3.0, 4.0, "g"]
    assert tree_unflatten(TREE, tree_leaves(TREE)) == TREE
    with pytest.raises(ValueError, match="fewer"):
        tree_unflatten(TREE, [1.0])
    with pytest.raises(ValueError, match="more"):
        tree_unflatten(TREE, [*tree_leaves(TREE), 1.0])


def test_a_map_takes_the_leaves_of_all_trees_and_refuses_another_structure():
    assert tree_map(lambda a, b: a + b, Pair(1.0, [2.0]), Pair(3.0, [4.0])) == Pair(4.0, [6.0])
    for other in (Pair(1.0, [2.0, 3.0]), Pair(1.0, 2.0), 1.0):
        with pytest.raises(ValueError, match="differ in structure"):
            tree_map(lambda a, b: a + b, Pair(1.0, [2.0]), other)


def test_members_are_selected_on_the_last_axis_and_what_is_shared_stays():
    shared, rows = np.zeros((3, 1)), np.arange(6.0).reshape(2, 3)
    tree = Pair([rows, shared, 2.0, "name"], Gain.__new__(Gain))
    object.__setattr__(tree.second, "gain", np.arange(3.0))
    object.__setattr__(tree.second, "name", "g")
    kept = tree_select(tree, np.array([True, False, True]))
    np.testing.assert_array_equal(kept.first[0], rows[:, [0, 2]])
    assert kept.first[1] is shared
    assert kept.first[2:] == [2.0, "name"]
    np.testing.assert_array_equal(kept.second.gain, [0.0, 2.0])
    np.testing.assert_array_equal(tree_take(tree, np.array([2, 0])).first[0], rows[:, [2, 0]])
    assert tree_take(tree, np.array([2, 0])).first[1] is shared


def test_an_array_whose_last_axis_is_not_of_members_is_refused_however_its_other_axes_are_long():
    with pytest.raises(ValueError, match=r"shape \(3, 2\) has no last axis for 3 members"):
        tree_select([np.zeros((3, 2))], np.ones(3, bool))


def test_one_member_of_a_tree_has_numbers_in_place_of_arrays():
    tree = {"a": np.array([1.0, 2.0]), "b": [np.array([[1.0, 2.0]]), 3.0], "c": np.array([7.0])}
    one = tree_member(tree, 1)
    assert (one["a"], one["b"][1], one["c"]) == (2.0, 3.0, 7.0)
    assert type(one["a"]) is float
    np.testing.assert_array_equal(one["b"][0], [2.0])


def test_a_tree_falls_apart_into_those_of_its_members():
    tree = {"a": np.array([1.0, 2.0]), "b": [3.0, {}], "c": np.array([7.0])}
    assert tree_by_member(tree, 2) == [{"a": a, "b": [3.0, {}], "c": 7.0} for a in (1.0, 2.0)]
