"""Reference motions of scenes, in as many digits as asked for, and where they are stored."""
