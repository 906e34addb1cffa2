"""Loop of the guard process in C: it reads, asks, decides, writes and records without the interpreter."""
