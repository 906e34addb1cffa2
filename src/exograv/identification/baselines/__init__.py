"""Methods that the recursive filter is compared with."""
