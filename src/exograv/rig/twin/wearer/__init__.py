"""The twin's wearer: body, joints, muscles at rest, and fastening."""
