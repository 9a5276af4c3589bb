"""The live page: a node that keeps what it hears of a running loop and shows it in a browser on this machine."""
