"""Coulomb friction: the law, stick-slip states, and the motion across their switches."""
