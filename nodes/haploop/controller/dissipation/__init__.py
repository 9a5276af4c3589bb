"""Dissipation elements: one per file, or one family, all of the same form.

``element`` is that form, ``damping`` the simplest.
"""

from haploop.controller.dissipation.element import Element, ElementError, Motion
from haploop.controller.dissipation.registry import PluginError, load_plugin, registry
from haploop.protocol.arrays import where
from haploop.protocol.quantity import Quantity

__all__ = ["Element", "ElementError", "Motion", "PluginError", "Quantity", "load_plugin", "registry", "where"]
