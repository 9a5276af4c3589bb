"""What every process agrees on: messages, wire format, sockets and the rules of the clock."""
