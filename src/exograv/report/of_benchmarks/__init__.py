"""Pages of benchmarks: identification methods and transparency."""
