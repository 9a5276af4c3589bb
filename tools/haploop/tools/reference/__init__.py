"""Reference motions of scenes, stored or made on the spot; ``tests/oracles/continuous`` makes the stored ones."""
