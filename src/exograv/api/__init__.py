"""Public Python API: the classes and functions that `import exograv` offers.

Each name is imported from its module on first use (`exograv/__init__.py`), so that the import of the package is cheap.
"""
