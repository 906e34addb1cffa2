"""Watch over an arm that is known: does the torque of machine and arm still agree with the model?"""
