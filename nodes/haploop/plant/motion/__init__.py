"""The motion of one mass under held forces by the exact transition, and the force of the hand."""
