"""The sampled controller: estimators, wall, dissipation elements and the controller process."""
