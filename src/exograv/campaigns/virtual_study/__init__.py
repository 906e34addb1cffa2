"""Virtual people train, fly and are compared: what a training is worth, by mechanism. No evidence about people."""
