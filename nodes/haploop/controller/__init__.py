"""The sampled controller: estimators, wall, dissipation elements and the controller process.

``controller.Controller`` answers a measured position with a force.
"""
