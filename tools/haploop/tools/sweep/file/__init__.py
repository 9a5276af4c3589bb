"""The sweep file: axes, cells and what is recorded, resolved and checked."""
