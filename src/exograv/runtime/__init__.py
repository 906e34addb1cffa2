"""Time: how one tick follows another, with a clock that is real or virtual."""
