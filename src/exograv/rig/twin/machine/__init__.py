"""The twin's machine: drives, sensors and links as they really are."""
