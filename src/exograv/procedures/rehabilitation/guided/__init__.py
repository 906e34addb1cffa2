"""One arm is led, and the machine repeats or mirrors it, gently enough to be overruled (docs/guided.md)."""
