"""From a scene file to a finished run: scene, plan, clock and launcher."""
