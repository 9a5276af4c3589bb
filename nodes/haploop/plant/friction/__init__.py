"""Coulomb friction: the law, stick-slip states, and the motion across their switches.

``stick_slip`` holds the law, ``motion`` the motion of one loop, ``batch`` that of many.
"""
