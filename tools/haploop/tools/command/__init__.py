"""What the commands of every tool share: options, the code of plugins, notes, and leaving on Ctrl-C."""
